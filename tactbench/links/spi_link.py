"""SPI links, and the link to a bus behind a microcontroller, the bridge, which has a serial port to the host.

Version 1 of this project's frame format is specified in ``docs/links.md``. Zero bytes stand between frames and nowhere
else (consistent overhead byte stuffing, S. Cheshire and M. Baker, IEEE/ACM Transactions on Networking 7(2), 1999), so
that after a fault the next frame is read correctly again.
"""

from __future__ import annotations

import struct
import zlib
from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from tactbench.core.errors import LinkError, LinkTimeout
from tactbench.links.link import ByteLink, Link

VERSION = 1
LARGEST_PAYLOAD = 0xFFFF

_HEAD = struct.Struct("<BBHH")
_CRC = struct.Struct("<I")
_LARGEST_FRAME = (_HEAD.size + LARGEST_PAYLOAD + _CRC.size) * 255 // 254 + 2
"""Size of the largest frame [bytes]: stuffing adds one byte to each 254 bytes, and one more."""


@dataclass(frozen=True, slots=True)
class SpiStep:
    """One SPI transfer: select a device, exchange bytes, release the device, pause."""

    data: bytes
    """Bytes to send; equally many bytes are received. Empty: the step is only a pause."""
    select: int = 1
    """Mask of the active select lines, line i being bit i; the board defines the wiring of the lines."""
    pause_us: int = 0
    """Shortest pause with no active line after the transfer [us]; up to 65535."""


@dataclass(frozen=True, slots=True)
class SpiReply:
    """Reply to one batch: the bytes received, and their time."""

    number: int
    """Number of the batch, as returned by :meth:`SpiLink.send`."""
    data: tuple[bytes, ...]
    """Received bytes, one entry for each step of the batch, as long as the data sent in this step."""
    t_ns: int
    """Time of receipt [ns of the link's clock]."""
    device_us: int | None = None
    """Beginning of the batch by the adapter's own counter of microseconds, modulo 2**32; None: no counter."""


class SpiLink(Link):
    """Link to an SPI bus, for batches of transfers and their replies in the same order.

    The adapter executes a batch without the host, so that pauses of some ten microseconds are kept; the next batch may
    be sent before the last reply is received. For another kind of adapter, write a subclass with :meth:`send`,
    :meth:`receive`, :meth:`_release` and, where replies can get lost, :meth:`abandon`.

    Attributes
    ----------
    speed_hz
        Clock of the SPI bus [Hz].
    holds
        Largest number of batches sent and not yet answered; 1 if :meth:`send` itself executes a batch.
    """

    speed_hz: int
    holds: int = 2

    _number = -1

    @abstractmethod
    def send(self, steps: Sequence[SpiStep]) -> int:
        """Send a batch and return its number: 0, 1, 2, …, after 65535 again 0; at most `holds` may be unanswered.

        Raises the errors of every :class:`Link`, LinkError if the batch is longer than the adapter takes. Other
        refusals of the adapter are raised by :meth:`receive`.
        """

    @abstractmethod
    def receive(self, timeout_s: float) -> SpiReply:
        """Return the next reply; the number of a lost reply is skipped. Raises the errors of every :class:`Link`."""

    def abandon(self) -> None:
        """Stop waiting for all outstanding replies; late replies are dropped. Raises nothing."""

    def _next_number(self) -> int:
        self._usable()
        self._number = (self._number + 1) & 0xFFFF
        return self._number


class Kind(IntEnum):
    """Kinds of frames, as numbers; a reply has the number of its request with the top bit set."""

    HELLO = 0x01
    SETUP = 0x02
    BATCH = 0x03
    ERROR = 0x7F

    @property
    def reply(self) -> int:
        """Code of the frame that replies to a request of this kind."""
        return self | 0x80


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame with correct length and CRC."""

    kind: int
    number: int
    """Number of the request; the reply has the same number."""
    payload: bytes = b""
    version: int = VERSION


def encode_frame(frame: Frame) -> bytes:
    """Return the bytes of a frame, its closing zero included."""
    body = _HEAD.pack(frame.version, frame.kind, frame.number, len(frame.payload)) + frame.payload
    return _stuffed(body + _CRC.pack(zlib.crc32(body))) + b"\0"


class FrameDecoder:
    """Decoder of frames from pieces of received bytes."""

    def __init__(self) -> None:
        self._pending = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes; invalid data between two zero bytes are dropped."""
        *ended, rest = (self._pending + data).split(b"\0")
        self._pending = rest[-_LARGEST_FRAME:]  # of a longer one the end, which is no frame
        return [frame for stuffed in ended if (frame := _frame_in(stuffed)) is not None]


def _frame_in(stuffed: bytes) -> Frame | None:
    body = _unstuffed(stuffed)
    if body is None or len(body) < _HEAD.size + _CRC.size:
        return None
    version, kind, number, length = _HEAD.unpack_from(body)
    payload = body[_HEAD.size : -_CRC.size]
    if length != len(payload) or _CRC.unpack(body[-_CRC.size :])[0] != zlib.crc32(body[: -_CRC.size]):
        return None
    return Frame(kind, number, payload, version)


def _stuffed(body: bytes) -> bytes:
    out = bytearray()
    for part in body.split(b"\0"):
        while len(part) > 253:
            out += b"\xff" + part[:254]
            part = part[254:]
        out += bytes([len(part) + 1]) + part
    return bytes(out)


def _unstuffed(stuffed: bytes) -> bytes | None:
    out = bytearray()
    place = 0
    while place < len(stuffed):
        code = stuffed[place]
        end = place + code
        if end > len(stuffed):
            return None
        out += stuffed[place + 1 : end]
        if code < 0xFF and end < len(stuffed):
            out.append(0)
        place = end
    return bytes(out)


HELLO = struct.Struct("<HHBB")
"""Head of the reply to HELLO, before the bridge's name: firmware, largest payload, batches held, select lines."""
SETUP = struct.Struct("<IB")
"""Payload of a SETUP request and of its reply: SPI clock [Hz], SPI mode."""
STEP = struct.Struct("<BHH")
"""Head of each step in a BATCH request: select mask, pause [us], number of bytes."""
BEGIN = struct.Struct("<I")
"""Head of the reply to a BATCH request: the batch's time of beginning [us]."""
FULL = b"full"
"""Text of the error reply to a batch for which the bridge has no room."""

_ASK_S = 0.2
"""Interval at which an unanswered request to the bridge, other than a batch, is repeated [s] (assumed)."""


class SpiBridge(SpiLink):
    """An SPI bus behind a bridge that uses this project's frame format, version 1 (``docs/links.md``).

    Parameters
    ----------
    port
        Open port of the bridge, closed with this link, or if this link cannot be made. The port's clock and timer give
        the times of receipt and the timeouts.
    speed_hz
        Highest permitted clock of the SPI bus [Hz].
    mode
        SPI mode, 0 to 3.
    wake_s
        Longest time until the bridge answers [s]: many microcontrollers start anew when their port is opened.

    Attributes
    ----------
    name, firmware
        Name and firmware version that the bridge reports.
    select_lines
        Bit mask of the bridge's select lines.
    speed_hz
        Clock of the SPI bus as the bridge has set it [Hz].
    holds
        Largest number of batches in the bridge, the running one included.

    Raises
    ------
    LinkError
        If no bridge answers, or the bridge uses another format version or does not support `mode`.
    """

    def __init__(self, port: ByteLink, *, speed_hz: int, mode: int = 0, wake_s: float = 3.0) -> None:
        super().__init__(f"spi://bridge/{port.address}")
        self._decoder = FrameDecoder()
        self._frames: deque[tuple[Frame, int]] = deque()
        self._waiting: dict[int, tuple[int, ...]] = {}
        self._bytes = port
        try:
            hello = self._answer(Kind.HELLO, b"", wake_s)
            layout = f"{HELLO.format}{len(hello.payload) - HELLO.size}s"
            self.firmware, self._largest, self.holds, self.select_lines, name = self._unpacked(layout, hello)
            self.name = name.decode("ascii", "replace")
            setup = self._answer(Kind.SETUP, SETUP.pack(speed_hz, mode), 1.0)
            self.speed_hz, _ = self._unpacked(SETUP.format, setup)
        except BaseException:
            self._bytes.close()
            raise

    def timer(self) -> float:
        """Return the time by which the port's timeouts are measured [s]."""
        return self._bytes.timer()

    def _answer(self, kind: Kind, payload: bytes, timeout_s: float) -> Frame:
        """Send a request other than a batch, repeated until it is answered; return the reply, and drop other frames."""
        end_s = self.timer() + timeout_s
        while (now_s := self.timer()) < end_s:
            self._bytes.write(b"\0" + encode_frame(Frame(kind, 0, payload)))
            with suppress(LinkTimeout):
                while True:
                    frame, _ = self._next(_ASK_S, min(now_s + _ASK_S, end_s))
                    if frame.version != VERSION:
                        raise LinkError(
                            f"{self.address}: the bridge uses version {frame.version} of the format, expected is "
                            f"{VERSION}.",
                            hint="Update the bridge's firmware, or tactbench.",
                        )
                    if frame.kind == Kind.ERROR.reply:
                        raise self._refused(frame)
                    if frame.kind == kind.reply:
                        return frame
        raise LinkError(
            f"{self.address}: no SPI bridge answered within {timeout_s:g} s.",
            hint="Check that the port is the bridge's, and its firmware that of docs/links.md.",
        )

    def _next(self, timeout_s: float, deadline: float) -> tuple[Frame, int]:
        """Return the next frame, and the time of receipt of its last byte [ns]."""
        while not self._frames:
            left_s = deadline - self.timer()
            try:
                received = self._bytes.read(max(0.0, left_s))
            except LinkTimeout:
                raise self._nothing_came(timeout_s) from None
            self._frames.extend((frame, received.t_ns) for frame in self._decoder.feed(received.data))
        return self._frames.popleft()

    def send(self, steps: Sequence[SpiStep]) -> int:  # noqa: D102  (inherited)
        number = self._next_number()
        payload = b"".join(STEP.pack(step.select, step.pause_us, len(step.data)) + step.data for step in steps)
        if len(payload) > self._largest:
            raise LinkError(
                f"{self.address}: the batch has {len(payload)} bytes, the bridge takes {self._largest} at most.",
                hint="Send the steps in several batches.",
            )
        self._bytes.write(encode_frame(Frame(Kind.BATCH, number, payload)))
        self._waiting[number] = tuple(len(step.data) for step in steps)
        return number

    def receive(self, timeout_s: float) -> SpiReply:  # noqa: D102  (inherited)
        deadline = self._usable(timeout_s)
        while True:
            frame, t_ns = self._next(timeout_s, deadline)
            if frame.kind not in (Kind.BATCH.reply, Kind.ERROR.reply) or frame.number not in self._waiting:
                continue  # doubled or late
            if frame.kind == Kind.ERROR.reply:  # may come before the replies to earlier batches, which still run
                del self._waiting[frame.number]
                if frame.payload == FULL:  # it still has batches that were abandoned here: this one is lost, too
                    continue
                raise self._refused(frame)
            for number in list(self._waiting):
                lengths = self._waiting.pop(number)
                if number == frame.number:
                    break
            begun_us, *data = self._unpacked(BEGIN.format + "".join(f"{length}s" for length in lengths), frame)
            return SpiReply(frame.number, tuple(data), t_ns, begun_us)

    def abandon(self) -> None:  # noqa: D102
        self._waiting.clear()

    def _refused(self, frame: Frame) -> LinkError:
        reason = frame.payload.decode("ascii", "replace") or "it gives no reason"
        return LinkError(
            f"{self.address}: the bridge refuses request {frame.number}: {reason}.",
            hint="See the errors of the bridge in docs/links.md.",
        )

    def _unpacked(self, layout: str, frame: Frame) -> tuple[Any, ...]:
        try:
            return struct.unpack(layout, frame.payload)
        except struct.error as error:
            raise LinkError(
                f"{self.address}: the bridge's reply to request {frame.number} has a wrong length: "
                f"{len(frame.payload)}.",
                hint="Check that the bridge runs the firmware of docs/links.md.",
            ) from error

    def _release(self) -> None:
        self._bytes.close()
