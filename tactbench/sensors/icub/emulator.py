"""Boards with iCub fingertips on a CAN bus, as a model without input or output: frames in, frames out.

What a board does is that of an MTB4's firmware [sourced: robotology/icub-firmware, IF:
``embot_app_application_theSkin.cpp``, ``AD7147.cpp``, ``embot_prot_can.cpp``]; where the model guesses, it is
tagged [assumed]. Time is given, never read.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import ClassVar, Literal, TypeAlias

from tactbench.plugin import UsageError
from tactbench.plugin.devices import CanFrame, DeviceEmulator, EmulatorSettings, Fault, fault_concerns, read_options
from tactbench.sensors.icub.channels import STREAMS
from tactbench.sensors.icub.codec import (
    BIT_RATE,
    BROADCAST,
    HEAD,
    NO_ACK,
    NOT_CONNECTED,
    SKIN,
    TAIL,
    TAXELS,
    BoardSetup,
    Command,
    OldSetup,
    Transmit,
    TriangleSetup,
    Version,
    VersionRequest,
    read_command,
    reading,
    skin_frames,
    version_frame,
)
from tactbench.sensors.icub.options import FingertipOptions

Sense: TypeAlias = Callable[[int, float], Sequence[int] | None]
"""(triangle, seconds) -> 12 results of its AD7147, 0 to 65535, rising under pressure; None: no chip there."""

ABSENT = (0xFFFF,) * TAXELS
"""What a board reads where no chip answers [sourced: IF AD7147.cpp]."""
VERSION = Version(11, (1, 0, 1), (2, 0), True)
"""An MTB4 [sourced: icub-firmware, eobrd_cantype_mtb4] with the numbers of a public application [sourced: IF, vAP and
vCP of its main]."""
REST_RESULT = 0x8000
"""Result with nothing touching [assumed: middle of the converter]; only differences from it reach the bus, except in
the raw test."""
QUEUE_FRAMES = 64
"""Frames that a board keeps while the bus is busy; what does not fit is lost [assumed: two periods of a full board]."""
FORCED_AFTER = 5
"""Triangles read with a taxel that does not acknowledge, until the board takes a new baseline by itself [sourced]."""

_GAINS = {
    0: (70, 96, 83, 38, 38, 70, 0, 45, 77, 164, 0, 77),
    8: (58, 91, 39, 23, 35, 90, 0, 38, 68, 115, 0, 86),
}
"""Skin type -> share, in 128ths, of taxel 6's change that is taken off each taxel against temperature [sourced: IF
theSkin]. Type 1 (palm and fingertip) has zeros, 2 and 7 nothing of the kind."""
_TEMPERATURE_TAXEL = 6
_RAW_TEST = 7
_NOT_MODELLED = 3
"""The ergoCub's hand, which numbers its triangles anew."""

_CHANNELS = tuple(channel.name for channel in STREAMS[0].channels)


@dataclass(frozen=True)
class BoardFault(Fault):
    """Something wrong with a board; nothing is random.

    `every` counts frames, of those that are dropped, doubled or late.

    Raises
    ------
    UsageError
        For an unknown name, or a number outside its range.
    """

    known: ClassVar[Mapping[str, str]] = {
        "dropped-frame": "frames are not sent",
        "doubled-frame": "frames are sent twice",
        "late-answer": "frames, answers included, come later by delay_s",
        "stuck-taxel": "the taxels `channels` keep the results they had when the fault began",
        "not-connected": "the chip does not answer: all results are FFFF",
        "no-ack": "the taxels `channels` are not acknowledged: their results are 0",
        "error-word": "the tail carries the bits of `word` besides its own",
        "unplugged": "the board has no power: it does not answer, and must be set up anew afterwards",
    }

    triangle: int | None = None
    """None: all."""
    half: Literal["head", "tail"] | None = None
    """Which frames are dropped, doubled or late; None: both."""
    channels: frozenset[str] = frozenset({"T1"})
    word: int = NO_ACK
    """Bits of the error word."""
    delay_s: float = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        good = self.half in (None, "head", "tail") and 0 <= self.word <= 0xFFFF and self.delay_s >= 0
        if not good or not self.channels <= set(_CHANNELS):
            raise UsageError(
                f"The fault {self.name!r} has a value outside its range.",
                hint="half is head or tail, channels are T1 to T12, word 0 to 0xFFFF, delay_s is not negative.",
            )

    def concerns(self, triangle: int | None, now_s: float) -> bool:
        """Return whether it is on, and on that triangle (None: on frames of no triangle)."""
        return self.active(now_s) and self.triangle in (None, triangle)


def results_of(readings: Iterable[float], rest: float = 243.0, shift: int = 2) -> tuple[int, ...]:
    """Return the converter results behind readings in the counts of the sensor's spec.

    Parameters
    ----------
    readings
        Counts, falling under pressure, as a transducer gives them.
    rest
        Reading at :data:`REST_RESULT`.
    shift
        One count is ``2**shift`` results [assumed: the firmware's default, as no source states the setting behind the
        spec's gain].

    Returns
    -------
    Integers 0 to 65535. A board with the same shift sends ``no_load + reading - reading at its baseline``, to one
    count: readings are rounded to a result here, and to a count by the board.
    """
    return tuple(min(max(REST_RESULT + round((rest - value) * 2**shift), 0), 0xFFFF) for value in readings)


class Board:
    """One board: what it was told, its baselines, when it sends next.

    Parameters
    ----------
    address
        0 to 14.
    sense
        What its chips measure.
    faults
        What is wrong with it; may be changed at any time.
    version
        What it answers when asked.
    unloaded
        What its chips measure when a set-up lets it take a baseline; None: as ever. A baseline that it takes by itself
        is of what it measures then.

    Attributes
    ----------
    ignored
        Commands passed over: unknown to the firmware, a range out of order, or skin type 3, which is not modelled.
    lost
        Frames lost because the bus was busy for too long.

    Raises
    ------
    UsageError
        If the address is not 0 to 14.
    """

    def __init__(
        self,
        address: int,
        sense: Sense,
        faults: Iterable[BoardFault] = (),
        version: Version = VERSION,
        unloaded: Sense | None = None,
    ) -> None:
        if not 0 <= address < BROADCAST:
            raise UsageError(f"A board has no address {address}.", hint="Give 0 to 14.")
        self.address = address
        self.faults = list(faults)
        self.ignored = 0
        self.lost = 0
        self.next_s = math.inf
        """When it reads and sends next, seconds; infinite while it does not send."""
        self._sense = sense
        self._unloaded = unloaded or sense
        self._version = version
        self._seen: Counter[Fault] = Counter()
        self._stuck: dict[tuple[BoardFault, int, int], int] = {}
        self._baseline: list[Sequence[int]] = []
        self._no_acks = 0
        self._shift = [2] * 16
        self._defaults()

    def _defaults(self) -> None:
        self._setup = BoardSetup(skin_type=0, period_ms=50, no_load=245)
        self._active = [True] * 16

    @property
    def no_load(self) -> int:
        """Reading at rest, as it is set up now."""
        return self._setup.no_load

    def shift(self, triangle: int) -> int:
        """Return how many bits of a result are dropped, as it is set up now."""
        return self._shift[triangle]

    def command(self, command: Command, now_s: float, source: int = 0) -> list[CanFrame]:
        """Carry out `command` from `source` at `now_s` and return what is answered."""
        if self._unplugged(now_s):
            return []
        if not self._baseline:
            self._calibrate(now_s, self._unloaded)  # IF starts its chips with the first command
        match command:
            case BoardSetup(skin_type=kind) if kind != _NOT_MODELLED:
                self._setup = command
                self._active = [False] * 16
                if self.next_s < math.inf:
                    self._start(now_s)
            case TriangleSetup(first, last, shift, enabled) if first <= last < 16:
                for triangle in range(first, last + 1):
                    self._active[triangle] = enabled
                    self._shift[triangle] = shift
                self.next_s = math.inf
                self._calibrate(now_s, self._unloaded)
            case Transmit(on=True):
                self._start(now_s)
            case Transmit(on=False):
                self.next_s = math.inf
            case OldSetup():
                self._defaults()
                self._setup = BoardSetup(skin_type=0, period_ms=40, no_load=245)
                self._calibrate(now_s, self._unloaded)
                self._start(now_s)
            case VersionRequest(major, minor):
                own = self._version
                fits = own.protocol[0] == major and own.protocol[1] >= minor
                answer = Version(own.board_type, own.firmware, own.protocol, fits)
                return [version_frame(self.address, answer, to=source)]
            case _:
                self.ignored += 1
        return []

    def tick(self) -> list[CanFrame]:
        """Read all chips at :attr:`next_s` and return head and tail of every enabled triangle."""
        now_s = self.next_s
        if self._unplugged(now_s):
            return []
        self.next_s += self._setup.period_ms * 1e-3
        self._stuck = {key: result for key, result in self._stuck.items() if key[0] in self.faults}
        if self._no_acks >= FORCED_AFTER:
            self._no_acks = 0
            self._calibrate(now_s, self._sense)
        frames: list[CanFrame] = []
        for triangle in range(16):
            if self._active[triangle]:
                taxels, word = self._fill(triangle, now_s)
                for fault in self.faults:
                    if fault.name == "error-word" and fault.concerns(triangle, now_s):
                        word |= fault.word
                frames += skin_frames(self.address, triangle, taxels, word)
        return frames

    def sent(self, frames: Iterable[CanFrame], now_s: float) -> list[tuple[float, CanFrame]]:
        """Return when each of `frames` is ready for the bus, seconds, after faults of sending."""
        ready = []
        for frame in frames:
            triangle = frame.id & 0xF if frame.id >> 8 == SKIN else None
            half = {HEAD: "head", TAIL: "tail"}.get(frame.data[0])
            copies, delay_s = 1, 0.0
            for fault in self.faults:
                if fault.triangle not in (None, triangle) or fault.half not in (None, half):
                    continue
                if fault_concerns([fault], "late-answer", now_s, self._seen):
                    delay_s += fault.delay_s
                elif fault_concerns([fault], "dropped-frame", now_s, self._seen):
                    copies = 0
                elif fault_concerns([fault], "doubled-frame", now_s, self._seen):
                    copies *= 2
            ready += [(now_s + delay_s, frame)] * copies
        return ready

    def _start(self, now_s: float) -> None:
        # A period of 0 sends nothing [assumed]; the first frames come one period after the start.
        period_s = self._setup.period_ms * 1e-3
        self.next_s = now_s + period_s if period_s else math.inf

    def _unplugged(self, now_s: float) -> bool:
        """Return whether it is without power, after which nothing that it was told is left."""
        if not any(fault.name == "unplugged" and fault.active(now_s) for fault in self.faults):
            return False
        self._defaults()
        self._shift = [2] * 16
        self._baseline = []
        self.next_s = math.inf
        return True

    def _results(self, triangle: int, now_s: float, sense: Sense) -> Sequence[int]:
        given = sense(triangle, now_s)
        if given is None:
            return ABSENT
        results = list(given)
        for fault in self.faults:
            if not fault.concerns(triangle, now_s):
                continue
            for taxel in (_CHANNELS.index(name) for name in fault.channels):
                if fault.name == "stuck-taxel":
                    results[taxel] = self._stuck.setdefault((fault, triangle, taxel), results[taxel])
                elif fault.name == "no-ack":
                    results[taxel] = 0
            if fault.name == "not-connected":
                return ABSENT
        return results

    def _calibrate(self, now_s: float, sense: Sense) -> None:
        self._baseline = [self._results(triangle, now_s, sense) for triangle in range(16)]

    def _fill(self, triangle: int, now_s: float) -> tuple[list[int], int]:
        results, baseline = self._results(triangle, now_s, self._sense), self._baseline[triangle]
        if self._setup.skin_type == _RAW_TEST:
            return [result & 0xFF for result in results], 0
        gains = _GAINS.get(self._setup.skin_type, (0,) * TAXELS)
        warmer = results[_TEMPERATURE_TAXEL] - baseline[_TEMPERATURE_TAXEL]
        taxels, word, silent = [], 0, False
        for taxel, (result, base, gain) in enumerate(zip(results, baseline, gains, strict=True)):
            # As in IF: the size is shifted, then given its sign, then shifted again, which rounds downwards.
            drift = (1 if warmer > 0 else -1) * (abs(warmer) >> 2) * gain >> 5
            value, beyond = reading(result - base - drift, self._setup.no_load, self._shift[triangle])
            taxels.append(value)
            word |= beyond << 4 + taxel
            silent = silent or (result == 0 and base != 0)
        if silent:
            word |= NO_ACK
            self._no_acks += 1
        if all(result == 0xFFFF for result in results):
            word |= NOT_CONNECTED
        return taxels, word


def frame_s(frame: CanFrame) -> float:
    """Return how long a frame with an 11-bit identifier holds the bus, seconds, with all possible stuff bits.

    [derived: CAN 2.0A, 44 bits and 8 a byte, of which 34 and 8 a byte are stuffed after each fourth, and 3 between
    frames: 135 bits for 8 bytes]
    """
    bits = 8 * len(frame.data)
    return (44 + bits + (33 + bits) // 4 + 3) / BIT_RATE


class Bus(DeviceEmulator):
    """Boards on one bus: one frame at a time, the lowest identifier first among those that are ready.

    Commands take no time on it [assumed: they are rare].

    Parameters
    ----------
    boards
        With addresses of their own.

    Raises
    ------
    UsageError
        If two boards have one address.
    """

    def __init__(self, boards: Iterable[Board]) -> None:
        listed = list(boards)
        self.boards = {board.address: board for board in listed}
        if len(self.boards) < len(listed):
            raise UsageError("Two boards have one address.", hint="Give each board an address of its own.")
        self._number = count()
        self._later: list[tuple[float, int, Board, CanFrame]] = []
        """Heap of frames by the time at which they are ready."""
        self._waiting: list[tuple[int, int, Board, CanFrame]] = []
        """Heap of ready frames by identifier."""
        self._on_wire: tuple[float, CanFrame] | None = None
        self._free_s = -math.inf
        self._queued = dict.fromkeys(self.boards, 0)

    def next_s(self) -> float:
        """Return when `poll` has something to do next, seconds; infinite: not before a command."""
        if self._on_wire:
            return self._on_wire[0]
        return self._begin_s()

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[tuple[float, CanFrame]]:
        """Return what `poll(now_s)` does, after which every board that the frame addresses carries it out."""
        out = self.poll(now_s)
        assert isinstance(piece, CanFrame)
        found = read_command(piece)
        if found is None:
            return out
        destination, command = found
        for address, board in self.boards.items():
            if destination in (address, BROADCAST):
                self._queue(board, board.command(command, now_s, source=piece.id >> 4 & 0xF), now_s)
        return out

    def poll(self, now_s: float) -> list[tuple[float, CanFrame]]:
        """Return the frames that ended up to `now_s`, in order, each with the second of its end and stamped with it."""
        out: list[tuple[float, CanFrame]] = []
        while True:
            if self._on_wire:
                end_s, frame = self._on_wire
                if not end_s <= now_s:
                    return out
                out.append((end_s, replace(frame, t_ns=round(1e9 * end_s))))
                self._free_s, self._on_wire = end_s, None
            begin_s = self._begin_s()
            if not begin_s <= now_s:
                return out
            self._gather(begin_s)
            if self._waiting:
                _, _, board, frame = heapq.heappop(self._waiting)
                self._queued[board.address] -= 1
                self._on_wire = (begin_s + frame_s(frame), frame)

    def _begin_s(self) -> float:
        """When the next frame can start, or the next board reads its chips."""
        if self._waiting:
            return self._free_s
        events = [board.next_s for board in self.boards.values()]
        if self._later:
            events.append(self._later[0][0])
        return max(self._free_s, min(events, default=math.inf))

    def _gather(self, until_s: float) -> None:
        """Let boards read that are due, and make ready what is."""
        while (due := min(self.boards.values(), key=lambda board: board.next_s)).next_s <= until_s:
            now_s = due.next_s
            self._queue(due, due.tick(), now_s)
        while self._later and self._later[0][0] <= until_s:
            _, number, board, frame = heapq.heappop(self._later)
            heapq.heappush(self._waiting, (frame.id, number, board, frame))

    def _queue(self, board: Board, frames: Iterable[CanFrame], now_s: float) -> None:
        for ready_s, frame in board.sent(frames, now_s):
            if self._queued[board.address] >= QUEUE_FRAMES:
                board.lost += 1
                continue
            self._queued[board.address] += 1
            heapq.heappush(self._later, (ready_s, next(self._number), board, frame))


def build_emulator(settings: EmulatorSettings) -> Bus:
    """Return one board with the fingertip of the options, a device on a CAN bus.

    A real board sends differences from the baseline it took at its set-up. Here each set-up finds the fingertip
    unloaded, at the reading `no_load`, and the chip's results are those behind what `senses` gives, by the board's
    present `no_load` and shift. So the byte on the bus is the count that was sensed, rounded to a whole one and kept
    within 0 to 255: exactly, without a fault, for skin types 1 and 2 (0 and 8 take off a share of T7's change), and
    until the board takes a baseline by itself, after samples that were not acknowledged. Taxels that `senses` leaves
    out read the spec's rest.

    Raises
    ------
    UsageError
        If an option or a fault is not known.
    """
    options = read_options(FingertipOptions, settings.options, "icub")
    rest = {channel.name: channel.rest.to("count") for channel in STREAMS[0].channels if channel.rest is not None}

    def sense(triangle: int, now_s: float) -> Sequence[int] | None:
        if triangle != options.triangle:
            return None
        sensed = {**rest, **settings.senses(now_s)}
        readings = [min(max(round(sensed[name]), 0), 255) for name in _CHANNELS]
        return results_of(readings, rest=board.no_load, shift=board.shift(triangle))

    def unloaded(triangle: int, now_s: float) -> Sequence[int] | None:
        return (REST_RESULT,) * TAXELS if triangle == options.triangle else None

    faults = [BoardFault.parse(text) for text in settings.faults]
    board = Board(options.board, sense, faults, unloaded=unloaded)
    return Bus([board])
