"""Emulator of a board with an iCub fingertip, alone on a CAN bus: a function from received frames to sent frames.

The behaviour is that of an MTB4's firmware [sourced: robotology/icub-firmware, IF:
``embot_app_application_theSkin.cpp``, ``AD7147.cpp``, ``embot_prot_can.cpp``]; guesses are tagged [assumed].
Every set-up assumes an unloaded fingertip, and the given counts are sent unchanged: neither baselines, which a real
board takes when it is set up and after five samples without acknowledgement, nor the compensation for temperature is
modelled. The time is an argument; no clock is read.
"""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from typing import ClassVar, Literal

from tactbench.plugin import UsageError
from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Senses,
    fault_concerns,
    read_options,
)
from tactbench.sensors.icub import STREAMS
from tactbench.sensors.icub.codec import (
    BIT_RATE,
    BROADCAST,
    HEAD,
    NO_ACK,
    NOT_CONNECTED,
    TAIL,
    TAXELS,
    BoardSetup,
    OldSetup,
    Transmit,
    TriangleSetup,
    Version,
    VersionRequest,
    read_command,
    skin_frames,
    version_frame,
)
from tactbench.sensors.icub.driver import FingertipOptions

VERSION = Version(11, (1, 0, 1), (2, 0), True)
"""Version of the emulated board: an MTB4 [sourced: icub-firmware, eobrd_cantype_mtb4] with the numbers of a public
application [sourced: IF, vAP and vCP of its main]."""
_REST = {channel.name: channel.rest.to("count") for channel in STREAMS[0].channels if channel.rest is not None}
_CHANNELS = tuple(_REST)


@dataclass(frozen=True)
class BoardFault(Fault):
    """A fault of the emulated board, without randomness.

    For dropped, doubled or late frames, `every` n selects every n-th frame.

    Raises
    ------
    UsageError
        For an unknown name, or a number outside its range.
    """

    known: ClassVar[Mapping[str, str]] = {
        "dropped-frame": "frames are not sent",
        "doubled-frame": "frames are sent twice",
        "late-answer": "frames, answers included, come later by delay_s",
        "stuck-taxel": "the taxels `channels` stay at what they read when the fault began",
        "not-connected": "the chip does not answer: all results are FFFF",
        "no-ack": "the taxels `channels` are not acknowledged: their results are 0",
        "unplugged": "the board has no power: it does not answer, and must be set up anew afterwards",
    }

    half: Literal["head", "tail"] | None = None
    """Half of the sample whose frames are dropped, doubled or late; None: both."""
    channels: frozenset[str] = frozenset({"T1"})
    delay_s: float = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        good = self.half in (None, "head", "tail") and self.delay_s >= 0
        if not good or not self.channels <= set(_CHANNELS):
            raise UsageError(
                f"The fault {self.name!r} has a value outside its range.",
                hint="Give half as head or tail, channels from T1 to T12, delay_s from 0 up.",
            )


def frame_s(frame: CanFrame) -> float:
    """Return the seconds that a frame with an 11-bit identifier occupies the bus, with all possible stuff bits.

    [derived: CAN 2.0A, 44 bits and 8 a byte, of which 34 and 8 a byte are stuffed after each fourth, and 3 between
    frames: 135 bits for 8 bytes]
    """
    bits = 8 * len(frame.data)
    return (44 + bits + (33 + bits) // 4 + 3) / BIT_RATE


class Bus(DeviceEmulator):
    """Emulated CAN bus with one board, which sends one frame at a time; commands take no time [assumed: they are rare].

    `senses` maps a time [s] to counts of taxels, rounded and clipped to 0-255; taxels left out are at rest. Other
    triangles of the board than the fingertip's have no chip. `faults` may be changed at any time.
    """

    def __init__(self, senses: Senses, *, board: int = 14, triangle: int = 0, faults: Iterable[BoardFault] = ()):
        self.faults = list(faults)
        self._senses, self._board, self._triangle = senses, board, triangle
        self._seen: Counter[Fault] = Counter()
        self._stuck: dict[tuple[BoardFault, int], int] = {}
        self._number = count()
        self._leaving: list[tuple[float, int, CanFrame]] = []
        """Heap of frames by the time at which they are ready for the bus."""
        self._free_s = -math.inf
        self._forget()

    def _forget(self) -> None:
        """Reset the board's settings to the firmware's defaults."""
        self._setup = BoardSetup(skin_type=0, period_ms=50, no_load=245)
        self._enabled = set(range(16))
        self._reads_s = math.inf

    def next_s(self) -> float:
        """Return the time [s] at which `poll` must be called next; infinity: not before a command."""
        return min(self._reads_s, self._first_end_s())

    def _first_end_s(self) -> float:
        """Return the time [s] at which the next frame ends on the bus; infinity if none is ready."""
        if not self._leaving:
            return math.inf
        ready_s, _, frame = self._leaving[0]
        return max(self._free_s, ready_s) + frame_s(frame)

    def poll(self, now_s: float) -> list[tuple[float, CanFrame]]:
        """Return (end [s], frame) of the frames that ended on the bus up to `now_s`, in order."""
        out: list[tuple[float, CanFrame]] = []
        while True:
            ready_s = self._leaving[0][0] if self._leaving else math.inf
            if self._reads_s <= min(now_s, ready_s):
                self._read()
            elif (end_s := self._first_end_s()) <= now_s:
                _, _, frame = heapq.heappop(self._leaving)
                out.append((end_s, replace(frame, t_ns=round(1e9 * end_s))))
                self._free_s = end_s
            else:
                return out

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[tuple[float, CanFrame]]:
        """Return the frames of `poll(now_s)`; then carry out `piece` if it is a command to this board."""
        out = self.poll(now_s)
        assert isinstance(piece, CanFrame)
        found = read_command(piece)
        if found is None or found[0] not in (self._board, BROADCAST) or self._unplugged(now_s):
            return out
        match found[1]:
            case BoardSetup() as setup:
                self._setup, self._enabled = setup, set()
                if self._reads_s < math.inf:
                    self._start(now_s)
            case TriangleSetup(first, last, _, enabled) if first <= last < 16:
                triangles = set(range(first, last + 1))
                self._enabled = self._enabled | triangles if enabled else self._enabled - triangles
                self._reads_s = math.inf
            case Transmit(on=True):
                self._start(now_s)
            case Transmit(on=False):
                self._reads_s = math.inf
            case OldSetup():
                self._forget()
                self._setup = replace(self._setup, period_ms=40)
                self._start(now_s)
            case VersionRequest(major, minor):
                fits = VERSION.protocol[0] == major and VERSION.protocol[1] >= minor
                self._send([version_frame(self._board, replace(VERSION, fits=fits), to=piece.id >> 4 & 0xF)], now_s)
        return out

    def _start(self, now_s: float) -> None:
        # A period of 0 sends nothing [assumed]; the first frames come one period after the start.
        period_s = self._setup.period_ms * 1e-3
        self._reads_s = now_s + period_s if period_s else math.inf

    def _unplugged(self, now_s: float) -> bool:
        """Return True while the board is without power, by which it loses its set-up."""
        if not any(fault.name == "unplugged" and fault.active(now_s) for fault in self.faults):
            return False
        self._forget()
        return True

    def _read(self) -> None:
        """Read the chips at a sampling time, and send the two frames of every enabled triangle."""
        now_s = self._reads_s
        if self._unplugged(now_s):
            return
        self._reads_s += self._setup.period_ms * 1e-3
        frames: list[CanFrame] = []
        for triangle in sorted(self._enabled):
            taxels, word = [self._setup.no_load] * TAXELS, NOT_CONNECTED
            if triangle == self._triangle:
                taxels, word = self._fingertip(now_s)
            frames += skin_frames(self._board, triangle, taxels, word)
        self._send(frames, now_s)

    def _fingertip(self, now_s: float) -> tuple[list[int], int]:
        """Return the fingertip's taxel bytes and error word.

        A taxel without acknowledgement has the converter's result 0; without a chip all have FFFF [sourced: IF
        AD7147.cpp]: far above and below the result at rest, in the middle of the range [assumed], and out of range.
        """
        sensed = {**_REST, **self._senses(now_s)}
        taxels = [min(max(round(sensed[name]), 0), 255) for name in _CHANNELS]
        word = 0
        for fault in (one for one in self.faults if one.active(now_s)):
            concerned = [_CHANNELS.index(name) for name in fault.channels]
            match fault.name:
                case "stuck-taxel":
                    for taxel in concerned:
                        taxels[taxel] = self._stuck.setdefault((fault, taxel), taxels[taxel])
                case "no-ack":
                    word |= NO_ACK
                    for taxel in concerned:
                        taxels[taxel] = 255
                        word |= 1 << 4 + taxel
                case "not-connected":
                    word |= NOT_CONNECTED | 0xFFF0
                    taxels = [0] * TAXELS
        return taxels, word

    def _send(self, frames: Iterable[CanFrame], now_s: float) -> None:
        """Queue frames for the bus; faults of sending may drop, double or delay them."""
        for frame in frames:
            half = {HEAD: "head", TAIL: "tail"}.get(frame.data[0])
            copies, ready_s = 1, now_s
            for fault in self.faults:
                if fault.half in (None, half) and fault_concerns([fault], fault.name, now_s, self._seen):
                    match fault.name:
                        case "late-answer":
                            ready_s += fault.delay_s
                        case "dropped-frame":
                            copies = 0
                        case "doubled-frame":
                            copies *= 2
            for _ in range(copies):
                heapq.heappush(self._leaving, (ready_s, next(self._number), frame))


def build_emulator(settings: EmulatorSettings) -> Bus:
    """Return the emulator of one board with the fingertip of the options; it uses no random numbers.

    The byte on the bus is the given count, rounded to an integer and limited to 0 to 255. Taxels that `senses` leaves
    out have the spec's rest level.

    Raises
    ------
    UsageError
        If an option or a fault is unknown.
    """
    options = read_options(FingertipOptions, settings.options, "icub")
    faults = [BoardFault.parse(text) for text in settings.faults]
    return Bus(settings.senses, board=options.board, triangle=options.triangle, faults=faults)
