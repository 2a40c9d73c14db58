"""A packet is 9A, checksum, command, length, data; the data are fields, each a byte type + 4 x finger and big-endian numbers.

Commands carry 0 as checksum. Assumed: a reply's checksum is not looked at, since no source gives its polynomial; replies
carry the command that was asked; fields before the static one may come in any order.
"""

import struct
from collections.abc import Iterator, Sequence

from tactbench.plugin.devices import ByteLink, CanFrame, Options, Received, RowDriver, RowEmulator, Sample

from tactbench_robotiq_tsf85 import STREAM

MARK, READ, HEAD, STATIC = 0x9A, 0x61, 4, 0x10
SIZES = {STATIC: 56, 0x20: 2, 0x30: 6, 0x40: 6, 0x50: 6, 0x60: 2, 0x70: 8}  # bytes of each field
PATIENCE_NS = 100_000_000  # a reply that has not come by then is lost: assumed


def packet(command: int, data: bytes = b"") -> bytes:
    """Return a packet."""
    return bytes((MARK, 0, command, len(data))) + data


def static_taxels(data: bytes, finger: int) -> tuple[int, ...] | None:
    """Return the 28 taxels of a finger, row by row; None where a packet's data have none."""
    while data and (size := SIZES.get(data[0] & 0xF0)) is not None and len(data) > size:
        if data[0] == STATIC + 4 * finger:
            return struct.unpack(">28H", data[1 : 1 + size])
        data = data[1 + size :]
    return None  # an unknown field ends a packet


class TSF85Options(Options):
    """Which finger."""

    finger: int = 0


class TSF85Driver(RowDriver[ByteLink]):
    """Asks for the next sample when the last has come."""

    stream, link_kind, options_kind = STREAM, ByteLink, TSF85Options
    _asked_ns: int | None = None
    _left = b""

    def ask(self) -> None:
        """Ask, unless a reply is under way."""
        if self._asked_ns is not None and self.clock() - self._asked_ns > PATIENCE_NS:
            self.counted["replies lost"] += 1
            self._asked_ns, self._left = None, b""
        if self._asked_ns is None:
            self.link.write(packet(READ))
            self._asked_ns = self.clock()

    def rows(self, received: Received) -> Iterator[Sample]:
        """Return the reply, once it is whole."""
        data = self._left + received.data
        self._left = data = data[data.find(MARK) :] if MARK in data else b""
        if len(data) >= HEAD and len(data) >= HEAD + data[3]:
            self._left, self._asked_ns = b"", None
            taxels = static_taxels(data[HEAD:][: data[3]], self.options.finger)
            if taxels is not None:
                yield Sample(taxels)


class Emulator(RowEmulator):
    """The sensor as a model: it answers each request with its static taxels."""

    stream, answer_s = STREAM, 0.005  # 61 bytes at 115200 baud

    def sent(self, values: Sequence[float]) -> list[bytes]:
        """Return a reply."""
        first = STATIC + 4 * self.settings.options.get("finger", 0)
        return [packet(READ, struct.pack(">B28H", first, *(round(value) for value in values)))]

    def told(self, piece: bytes | CanFrame, now_s: float) -> list[bytes]:
        """Answer."""
        return self.sent(self.sensed(now_s)) if piece == packet(READ) else []
