"""Conversion of the iCub skin's CAN frames to values and back, for boards (MTB, MTB4) that carry its fingertips.

A triangle is 12 taxels read by one AD7147 chip; a fingertip is one triangle; a board carries up to 16. Facts are
[sourced] from robotology/icub-firmware (IF: ``embot_prot_can*.cpp``, ``embot_app_application_theSkin.cpp``,
``AD7147.cpp``), robotology/icub-firmware-shared (``iCubCanProto_*.h``) and robotology/icub-main
(IM: ``CanBusSkin.cpp``) unless stated. The module has never been tested with a real board.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Sequence
from dataclasses import astuple, dataclass, field
from typing import TypeAlias

import numpy as np

from tactbench.plugin import Block, Quality, UsageError
from tactbench.plugin.devices import CanFrame

BIT_RATE = 1_000_000
"""Bits a second on the bus [sourced: IM, rate index 0, "1 MB/s" in its comment]."""
TAXELS = 12
HEAD, TAIL = 0x40, 0xC0
"""First byte of a triangle's head (frame with taxels 0 to 6) and of its tail (taxels 7 to 11 and the error word)."""
IN_HEAD = 7
"""Number of taxels in the first of a triangle's two frames, the head."""
POLLING, OLD_SKIN, SKIN = 2, 3, 4
"""Message classes (bits 8 to 10) of a CAN identifier. Class 3 is used by other analog sensors, too."""
BROADCAST = 0xF
"""Destination number of a command that addresses every board on the bus."""
NO_ACK, NOT_CONNECTED, RESERVED = 0x1, 0x2, 0xC
"""Low bits of the error word: some taxel did not acknowledge; the chip did not; bits without documented meaning."""


@dataclass(frozen=True)
class BoardSetup:
    """Command that sets skin type, period and reading at rest, and disables all triangles [sourced: IF theSkin].

    Types: 0 compensated for temperature, 1 palm and fingertip, 2 not compensated, 3 hand of the ergoCub, 7 raw test,
    8 compensated, version 2. The defaults are IM's (the firmware's own: 50 ms, 245) with type 1.
    """

    skin_type: int = 1
    period_ms: int = 40
    no_load: int = 240


@dataclass(frozen=True)
class TriangleSetup:
    """Command that sets shift and converter offset of triangles `first` to `last`, and enables or disables them.

    The board then stops sending and takes a new baseline of *all* triangles, so nothing may touch the skin. The board
    ignores a range that does not ascend within 0 to 15 [sourced: IF theSkin].
    """

    first: int = 0
    last: int = 15
    shift: int = 2
    enabled: bool = True
    cdc_offset: int = 0x2200


@dataclass(frozen=True)
class Transmit:
    """Command to the board to start or stop sending readings."""

    on: bool


@dataclass(frozen=True)
class OldSetup:
    """Old set-up command: MTB4 firmware ignores its numbers, takes a new baseline and *starts*, every 40 ms."""

    timer: int = 1
    cdc_offset: int = 0x2000
    time: int = 0


@dataclass(frozen=True)
class OldSetup2:
    """Second command of the old set-up, which MTB4 firmware does not have."""

    shift: int = 2
    shift_3_1: int = 0x22
    no_load: int = 240
    param: int = 0
    enabled: int = 0xFFFF


@dataclass(frozen=True)
class VersionRequest:
    """Request for the firmware's version, with the needed protocol version; the only command with an answer."""

    major: int = 2
    minor: int = 0


Command: TypeAlias = BoardSetup | TriangleSetup | Transmit | OldSetup | OldSetup2 | VersionRequest
_LAYOUTS: dict[type[Command], tuple[int, str, bytes, bytes]] = {
    BoardSetup: (0x4D, "<3B", b"", b""),
    TriangleSetup: (0x50, "<4BH", b"", b""),
    Transmit: (0x07, "<B", b"", b""),
    OldSetup: (0x4C, "<BHH", b"\x01\x01", b""),
    OldSetup2: (0x4E, "<4BH", b"", b"\x0a"),
    VersionRequest: (0x1C, "<2B", b"", b""),
}
"""First byte of each command, layout of its fields, and fixed bytes before and after them."""


@dataclass(frozen=True)
class Version:
    """Answer to :class:`VersionRequest` [sourced: IF embot_prot_can.cpp, Message_GET_VERSION]."""

    board_type: int
    """Number of the board's type, 11 for the MTB4 [sourced: icub-firmware, eobrd_cantype_mtb4]."""
    firmware: tuple[int, int, int]
    protocol: tuple[int, int]
    fits: bool
    """True if the board supports the requested protocol version."""


def polling_id(board: int, source: int = 0) -> int:
    """Return the CAN identifier of a command to `board` (15: to all boards) from the node `source`."""
    return POLLING << 8 | source << 4 | board


def skin_id(board: int, triangle: int, *, old: bool = False) -> int:
    """Return the CAN identifier of a triangle's two frames; with `old`, that of class 3, as early firmware sends."""
    return (OLD_SKIN if old else SKIN) << 8 | board << 4 | triangle


def command_frame(board: int, command: Command, *, source: int = 0) -> CanFrame:
    """Return the frame that carries `command` to a board, 0 to 14, or :data:`BROADCAST`, from `source`, 0 for a host.

    Raises
    ------
    UsageError
        If a number does not fit its field, or a range of triangles does not ascend within 0 to 15.
    """
    code, layout, before, after = _LAYOUTS[type(command)]
    if isinstance(command, TriangleSetup) and not 0 <= command.first <= command.last <= 15:
        raise UsageError(f"Triangles {command.first} to {command.last} do not ascend.", hint="Give two of 0 to 15.")
    numbers = (not command.on,) if isinstance(command, Transmit) else astuple(command)
    try:
        data = bytes([code]) + before + struct.pack(layout, *numbers) + after
    except struct.error as error:
        raise UsageError(
            f"{command} has a number that does not fit its field.", hint=f"Correct it: {error}."
        ) from error
    return CanFrame(polling_id(board, source), data)


def read_command(frame: CanFrame) -> tuple[int, Command] | None:
    """Return (destination board, command), or None if `frame` is not a known command or is too short."""
    if frame.extended or not 0 <= frame.id <= 0x7FF or frame.id >> 8 != POLLING or not frame.data:
        return None
    board, code, data = frame.id & 0xF, frame.data[0] & 0x7F, frame.data[1:]  # IF masks the code so
    kind = next((kind for kind, layout in _LAYOUTS.items() if layout[0] == code), None)
    if kind is None or (kind is VersionRequest and len(data) >= 7):  # with 7 it is a board's answer
        return None
    _, layout, before, _ = _LAYOUTS[kind]
    if kind is VersionRequest:
        data = data + bytes(2)
    if len(data) < len(before) + struct.calcsize(layout):
        return None
    numbers = struct.unpack_from(layout, data, len(before))
    if kind is Transmit:
        return board, Transmit(numbers[0] == 0)
    if kind is TriangleSetup:
        first, last, shift, enabled, cdc_offset = numbers
        return board, TriangleSetup(first, last, shift, bool(enabled & 1), cdc_offset)
    return board, kind(*numbers)


def version_frame(board: int, version: Version, *, to: int = 0) -> CanFrame:
    """Return the frame by which `board` answers the :class:`VersionRequest` of the node `to`."""
    numbers = (0x1C, version.board_type, *version.firmware, *version.protocol, version.fits)
    return CanFrame(polling_id(to, board), bytes(numbers))


def read_version(frame: CanFrame) -> tuple[int, Version] | None:
    """Return (board that answers, its version), or None if `frame` is no such answer."""
    if frame.extended or not 0 <= frame.id <= 0x7FF or frame.id >> 8 != POLLING or len(frame.data) != 8:
        return None
    code, kind, major, minor, build, protocol_major, protocol_minor, fits = frame.data
    if code & 0x7F != 0x1C:
        return None
    return frame.id >> 4 & 0xF, Version(kind, (major, minor, build), (protocol_major, protocol_minor), fits == 1)


def skin_frames(
    board: int, triangle: int, taxels: Sequence[int], word: int = 0, *, old: bool = False, t_ns: int = 0
) -> tuple[CanFrame, CanFrame]:
    """Return the two frames, head and tail, that carry a triangle's (12,) readings, 0 to 255, and error word.

    Bit 4 + i of the error word means that taxel i is out of range; lower bits: :data:`NO_ACK`, :data:`NOT_CONNECTED`.
    """
    values, identifier = bytes(taxels), skin_id(board, triangle, old=old)
    return (
        CanFrame(identifier, bytes([HEAD]) + values[:IN_HEAD], t_ns=t_ns),
        CanFrame(identifier, bytes([TAIL]) + values[IN_HEAD:] + word.to_bytes(2, "big"), t_ns=t_ns),
    )


@dataclass(frozen=True)
class Sample:
    """Readings of one triangle's 12 taxels at one time; none is interpolated or copied from another sample."""

    board: int
    triangle: int
    t_ns: int
    """Host time of the sample's first frame, nanoseconds."""
    taxels: bytes
    """(12,) counts, as the sensor's spec has them: 0 to 255, falling under pressure; 0 where missing."""
    quality: tuple[Quality, ...]
    """(12,) quality flags of the taxels."""


@dataclass
class _Triangle:
    counts: Counter[str] = field(default_factory=Counter)
    head: CanFrame | None = None
    """Last frame with taxels 0 to 6, as long as the frame with taxels 7 to 11 has not come."""
    tail: CanFrame | None = None
    """Last frame with taxels 7 to 11 and the error word."""
    doubled: tuple[int, ...] = ()
    """Numbers of the taxels in frames received twice since the last sample."""
    last_ns: int | None = None


class SkinDecoder:
    """Decoder of CAN frames, in their order on a bus or in a log, into samples.

    A head (taxels 0 to 6) and the next tail (taxels 7 to 11) are a sample. If they are half a period apart or more, all
    taxels are SUSPECT; from nine tenths on, they belong to two samples whose other halves were lost. Two heads or two
    tails in a row are one frame doubled if they are equal and less than half a period apart; otherwise a half is
    missing. Not detectable: a whole sample lost or doubled; which of two equal heads in a burst was doubled and which
    lost its tail.

    Quality of a sample: missing halves are MISSING, and a head without tail, hence without error word, is SUSPECT.
    A taxel out of range or at 0 or 255 is SATURATED, a taxel out of range also SUSPECT (the board's own test for broken
    taxels). A missing acknowledgement or a reserved bit that is set makes all taxels SUSPECT, the flag "not connected"
    makes all MISSING. The taxels of a doubled frame are SUSPECT in the next sample. A board in the raw test
    (type 7) sends the low bytes of its results, which cannot be distinguished from readings.

    Parameters
    ----------
    period_s
        The boards' period, seconds.
    old_ids
        Decode frames of class 3, too, which other analog sensors on the bus may send.

    Attributes
    ----------
    counts
        (board, triangle) -> numbers of faults so far, by name. An interval between samples is long above 1.5 periods:
        both frames were lost or the host was late; only a fit of the clocks can show which.
    foreign
        Number of frames that were no skin data.

    Raises
    ------
    UsageError
        If the period is not positive. No frame makes `feed` raise.
    """

    def __init__(self, period_s: float, *, old_ids: bool = False) -> None:
        if not period_s > 0:
            raise UsageError(f"A period of {period_s} s is not positive.", hint="Give the boards' period in seconds.")
        self.foreign = 0
        self._period_ns = 1e9 * period_s
        self._classes = (OLD_SKIN, SKIN) if old_ids else (SKIN,)
        self._triangles: dict[tuple[int, int], _Triangle] = {}

    @property
    def counts(self) -> dict[tuple[int, int], Counter[str]]:
        """(board, triangle) -> numbers of faults found so far, by name."""
        return {key: triangle.counts for key, triangle in self._triangles.items()}

    def feed(self, frame: CanFrame) -> list[Sample]:
        """Return the samples, at most two, that end with `frame`: complete, or with a frame missing."""
        data = frame.data
        known = not frame.extended and 0 <= frame.id <= 0x7FF and frame.id >> 8 in self._classes
        if not known or not data or data[0] not in (HEAD, TAIL):
            self.foreign += 1
            return []
        key = (frame.id >> 4 & 0xF, frame.id & 0xF)
        triangle = self._triangles.setdefault(key, _Triangle())
        # Old firmware's tail ends with taxel 11.
        if not (len(data) == 8 or (data[0] == TAIL and 1 + TAXELS - IN_HEAD <= len(data) < 8)):
            triangle.counts["frames of wrong length"] += 1
            return []
        is_head, head = data[0] == HEAD, triangle.head
        last = head if is_head else triangle.tail if head is None else None
        if not is_head:
            triangle.tail = frame
        if last is not None and self._near(last, frame) and last.data == data:
            triangle.counts["frames doubled"] += 1
            triangle.doubled += tuple(range(IN_HEAD) if is_head else range(IN_HEAD, TAXELS))
            return []
        triangle.head = frame if is_head else None
        if is_head:
            return [] if head is None else [self._sample(key, triangle, head, None)]
        if head is None or frame.t_ns - head.t_ns < 0.9 * self._period_ns:
            return [self._sample(key, triangle, head, frame)]
        return [self._sample(key, triangle, head, None), self._sample(key, triangle, None, frame)]

    def flush(self, before_ns: int | None = None) -> list[Sample]:
        """Return incomplete samples, of heads without a tail so far: those from before `before_ns`, or all."""
        found = []
        for key, triangle in self._triangles.items():
            head = triangle.head
            if head is not None and (before_ns is None or head.t_ns < before_ns):
                triangle.head = None
                found.append(self._sample(key, triangle, head, None))
        return found

    def _near(self, first: CanFrame, second: CanFrame) -> bool:
        return 0 <= second.t_ns - first.t_ns < self._period_ns / 2

    def _sample(
        self, key: tuple[int, int], triangle: _Triangle, head: CanFrame | None, tail: CanFrame | None
    ) -> Sample:
        counts = triangle.counts
        first = head or tail
        assert first is not None
        if triangle.last_ns is not None and first.t_ns - triangle.last_ns > 1.5 * self._period_ns:
            counts["long intervals"] += 1
        triangle.last_ns = first.t_ns
        taxels = (head.data[1:] if head else bytes(IN_HEAD)) + (tail.data[1:6] if tail else bytes(TAXELS - IN_HEAD))
        word = int.from_bytes(tail.data[6:]) if tail and len(tail.data) == 8 else None
        marks = [Quality.SATURATED if value in (0, 255) else Quality.GOOD for value in taxels]
        for taxel in triangle.doubled:
            marks[taxel] |= Quality.SUSPECT
        for taxel in range(TAXELS):
            if (word or 0) >> 4 + taxel & 1:
                marks[taxel] |= Quality.SATURATED | Quality.SUSPECT
                counts[f"T{taxel + 1} out of range"] += 1
        far_apart = head is not None and tail is not None and not self._near(head, tail)
        if far_apart or tail is None or (word or 0) & (NO_ACK | RESERVED):
            marks = [mark | Quality.SUSPECT for mark in marks]
        if head is None:
            marks[:IN_HEAD] = [Quality.MISSING] * IN_HEAD
        if tail is None:
            marks[IN_HEAD:] = [Quality.MISSING] * (TAXELS - IN_HEAD)
        if (word or 0) & NOT_CONNECTED:
            marks = [Quality.MISSING] * TAXELS
        wrong = {
            "heads missing": head is None,
            "tails missing": tail is None,
            "halves far apart": far_apart,
            "samples without error word": tail is not None and word is None,
            "samples not acknowledged": (word or 0) & NO_ACK,
            "samples not connected": (word or 0) & NOT_CONNECTED,
        }
        counts.update(name for name, found in wrong.items() if found)
        triangle.doubled = ()
        return Sample(*key, first.t_ns, taxels, tuple(marks))


def to_block(samples: Sequence[Sample], stream: str = "taxels") -> Block:
    """Return samples of one triangle as a block of the sensor's stream, without a sequence: the device has no counter.

    Taxel i of the board is channel ``T{i + 1}`` [assumed: the spec's places are assumed as well].
    """
    return Block(
        stream=stream,
        t_ns=np.array([sample.t_ns for sample in samples], dtype=np.int64),
        data=np.array([list(sample.taxels) for sample in samples], dtype=np.uint8).reshape(-1, TAXELS),
        quality=np.array([sample.quality for sample in samples], dtype=np.uint8).reshape(-1, TAXELS),
    )
