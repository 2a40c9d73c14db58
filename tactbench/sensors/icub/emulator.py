"""Boards with iCub fingertips on a CAN bus, as a model without input or output: frames in, frames out.

What a board does is that of an MTB4's firmware [sourced: robotology/icub-firmware, IF:
``embot_app_application_theSkin.cpp``, ``AD7147.cpp``, ``embot_prot_can.cpp``]; where the model guesses, it is
tagged [assumed]. Time is given, never read.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Literal, TypeAlias

from tactbench.plugin import CanFrame, UsageError
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

FAULTS = {
    "dropped-frame": "frames are not sent",
    "doubled-frame": "frames are sent twice",
    "late-answer": "frames, answers included, come later by delay_s",
    "stuck-taxel": "a taxel keeps the result it had when the fault began",
    "not-connected": "the chip does not answer: all results are FFFF",
    "no-ack": "a taxel is not acknowledged: its result is 0",
    "error-word": "the tail carries the bits of `word` besides its own",
}
"""Faults by name."""


@dataclass(frozen=True)
class Fault:
    """Something wrong with a board, from `start_s` until before `end_s`; nothing is random.

    Raises
    ------
    UsageError
        For a name not in :data:`FAULTS`, or a number outside its range.
    """

    name: str
    start_s: float = 0.0
    end_s: float = math.inf
    triangle: int | None = None
    """None: all."""
    half: Literal["head", "tail"] | None = None
    """Which frames are dropped, doubled or late; None: both."""
    every: int = 1
    """Of the frames that are dropped, doubled or late: each n-th."""
    taxel: int = 0
    """0 to 11."""
    word: int = NO_ACK
    """Bits of the error word."""
    delay_s: float = 0.01

    def __post_init__(self) -> None:
        if self.name not in FAULTS:
            raise UsageError(f"There is no fault called {self.name!r}.", hint=f"Known: {', '.join(FAULTS)}.")
        if self.every < 1 or not 0 <= self.taxel < TAXELS or not 0 <= self.word <= 0xFFFF or not self.delay_s >= 0:
            raise UsageError(
                f"The fault {self.name!r} has a number outside its range.",
                hint="every is 1 or more, taxel 0 to 11, word 0 to FFFF, delay_s not negative.",
            )

    def concerns(self, triangle: int | None, now_s: float) -> bool:
        """Whether it is on, and on that triangle (None: on frames of no triangle)."""
        return self.start_s <= now_s < self.end_s and self.triangle in (None, triangle)


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
        faults: Iterable[Fault] = (),
        version: Version = VERSION,
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
        self._version = version
        self._seen: dict[Fault, int] = {}
        self._stuck: dict[tuple[Fault, int], int] = {}
        self._baseline: list[Sequence[int]] = []
        self._no_acks = 0
        self._shift = [2] * 16
        self._defaults()

    def _defaults(self) -> None:
        self._setup = BoardSetup(skin_type=0, period_ms=50, no_load=245)
        self._active = [True] * 16

    def command(self, command: Command, now_s: float, source: int = 0) -> list[CanFrame]:
        """Carry out `command` from `source` at `now_s` and return what is answered."""
        if not self._baseline:
            self._calibrate(now_s)  # IF starts its chips with the first command
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
                self._calibrate(now_s)
            case Transmit(on=True):
                self._start(now_s)
            case Transmit(on=False):
                self.next_s = math.inf
            case OldSetup():
                self._defaults()
                self._setup = BoardSetup(skin_type=0, period_ms=40, no_load=245)
                self._calibrate(now_s)
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
        self.next_s += self._setup.period_ms * 1e-3
        self._stuck = {key: result for key, result in self._stuck.items() if key[0] in self.faults}
        if self._no_acks >= FORCED_AFTER:
            self._no_acks = 0
            self._calibrate(now_s)
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
                if (
                    fault.name not in ("dropped-frame", "doubled-frame", "late-answer")
                    or not fault.concerns(triangle, now_s)
                    or fault.half not in (None, half)
                ):
                    continue
                self._seen[fault] = self._seen.get(fault, 0) + 1
                if self._seen[fault] % fault.every:
                    continue
                if fault.name == "late-answer":
                    delay_s += fault.delay_s
                else:
                    copies = 0 if fault.name == "dropped-frame" else 2 * copies
            ready += [(now_s + delay_s, frame)] * copies
        return ready

    def _start(self, now_s: float) -> None:
        # A period of 0 sends nothing [assumed]; the first frames come one period after the start.
        period_s = self._setup.period_ms * 1e-3
        self.next_s = now_s + period_s if period_s else math.inf

    def _results(self, triangle: int, now_s: float) -> Sequence[int]:
        given = self._sense(triangle, now_s)
        if given is None:
            return ABSENT
        results = list(given)
        for fault in self.faults:
            if not fault.concerns(triangle, now_s):
                continue
            if fault.name == "stuck-taxel":
                results[fault.taxel] = self._stuck.setdefault((fault, triangle), results[fault.taxel])
            elif fault.name == "no-ack":
                results[fault.taxel] = 0
            elif fault.name == "not-connected":
                return ABSENT
        return results

    def _calibrate(self, now_s: float) -> None:
        self._baseline = [self._results(triangle, now_s) for triangle in range(16)]

    def _fill(self, triangle: int, now_s: float) -> tuple[list[int], int]:
        results, baseline = self._results(triangle, now_s), self._baseline[triangle]
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


class Bus:
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

    @property
    def next_s(self) -> float:
        """When `poll` has something to do next, seconds; infinite: not before a command."""
        if self._on_wire:
            return self._on_wire[0]
        return self._begin_s()

    def feed(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Return what `poll(now_s)` does, after which every board that `frame` addresses carries it out."""
        out = self.poll(now_s)
        found = read_command(frame)
        if found is None:
            return out
        destination, command = found
        for address, board in self.boards.items():
            if destination in (address, BROADCAST):
                self._queue(board, board.command(command, now_s, source=frame.id >> 4 & 0xF), now_s)
        return out

    def poll(self, now_s: float) -> list[CanFrame]:
        """Return the frames that ended up to `now_s`, in order, each with the time of its end."""
        out: list[CanFrame] = []
        while True:
            if self._on_wire:
                end_s, frame = self._on_wire
                if not end_s <= now_s:
                    return out
                out.append(replace(frame, t_ns=round(1e9 * end_s)))
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
