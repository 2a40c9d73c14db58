"""Frames of our own for byte streams: version, kind, number, length, payload and CRC, between zero bytes.

The format is this project's own, version 1; ``docs/links.md`` specifies it. Zero bytes stand between frames and nowhere
else (consistent overhead byte stuffing, S. Cheshire and M. Baker, IEEE/ACM Transactions on Networking 7(2), 1999), so
that a reader is in step again with the first frame after a fault.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

VERSION = 1
LARGEST_PAYLOAD = 0xFFFF

_HEAD = struct.Struct("<BBHH")
_CRC = struct.Struct("<I")
_LARGEST_FRAME = (_HEAD.size + LARGEST_PAYLOAD + _CRC.size) * 255 // 254 + 2
"""Bytes: stuffing adds one to each 254 and one more."""


class Kind(IntEnum):
    """What a frame of the SPI bridge is; a reply is its request's kind with the top bit set."""

    HELLO = 0x01
    SETUP = 0x02
    BATCH = 0x03
    ERROR = 0x7F

    @property
    def reply(self) -> int:
        """The kind of the reply."""
        return self | 0x80


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame whose length and CRC are right."""

    kind: int
    number: int
    """Of the request; its reply has the same."""
    payload: bytes = b""
    version: int = VERSION


def encode_frame(frame: Frame) -> bytes:
    """Return the bytes of a frame, its closing zero included."""
    body = _HEAD.pack(frame.version, frame.kind, frame.number, len(frame.payload)) + frame.payload
    return _stuffed(body + _CRC.pack(zlib.crc32(body))) + b"\0"


class FrameDecoder:
    """Frames from bytes as they come.

    Attributes
    ----------
    damaged
        How many stretches between two zero bytes were no frame so far.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._pending = b""

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes; what is no frame is counted."""
        *ended, rest = (self._pending + data).split(b"\0")
        self._pending = rest[-_LARGEST_FRAME:]  # of a longer one the end, which is no frame
        found = [_frame_in(stuffed) for stuffed in ended if stuffed]
        self.damaged += found.count(None)
        return [frame for frame in found if frame is not None]


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
