"""Emulator of the SPI bridge, which like an emulated device takes and returns bytes at times given by the caller.

The emulator is the reference for the bridge's firmware, which ``docs/links.md`` specifies.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from tactbench.links.spi_bridge import BEGIN, FULL, HELLO, SETUP, STEP, VERSION, Frame, FrameDecoder, Kind, encode_frame

Exchange = Callable[[int, bytes, float], bytes]
"""Function of a device on the bus: select mask, bytes sent, time of their beginning [s] -> as many bytes received."""


@dataclass
class BridgeEmulator:
    """Emulated bridge between a serial port and one SPI bus."""

    exchange: Exchange
    """Function of the device on the bus, which computes the bytes received from those sent."""
    holds: int = 4
    """Largest number of batches in the bridge, the running one included."""
    largest_payload: int = 4096
    """Largest payload of a frame [bytes]."""
    select_lines: int = 0xFF
    """Bit mask of the bridge's select lines."""
    fastest_hz: int = 10_000_000
    """Highest SPI clock [Hz]."""
    faults: set[str] = field(default_factory=set)
    """Present faults: ``dropped`` (batches run, their replies are not sent), ``doubled`` (replies are sent twice),
    ``damaged`` (one bit of each reply is inverted)."""

    def __post_init__(self) -> None:
        self._speed_hz = 0
        self._free_s = 0.0
        self._decoder = FrameDecoder()
        self._due: deque[tuple[float, bytes]] = deque()

    def feed(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Take bytes from the host and return the replies sent until `now_s`, each with its time of sending [s]."""
        out = self.poll(now_s)
        out += [(now_s, answer) for frame in self._decoder.feed(data) if (answer := self._answered(frame, now_s))]
        return out + self.poll(now_s)

    def poll(self, now_s: float) -> list[tuple[float, bytes]]:
        """Return the replies to batches finished by `now_s`, each with the time at which its batch finished [s]."""
        out = []
        while self._due and self._due[0][0] <= now_s:
            t_s, reply = self._due.popleft()
            if reply:
                out.append((t_s, reply))
        return out

    def next_s(self) -> float:
        """Return the time of the next reply to a batch [s]; infinite: no batch is running."""
        return self._due[0][0] if self._due else math.inf

    def _answered(self, frame: Frame, now_s: float) -> bytes:
        try:
            return self._executed(frame, now_s)
        except (ValueError, struct.error):
            return encode_frame(Frame(Kind.ERROR.reply, frame.number, b"malformed or not possible"))

    def _executed(self, frame: Frame, now_s: float) -> bytes:
        """Return the reply to a request, empty if sent later; raises ValueError or struct.error for a refusal."""
        if frame.version != VERSION or len(frame.payload) > self.largest_payload:
            raise ValueError
        match Kind(frame.kind):
            case Kind.HELLO:
                about = HELLO.pack(VERSION, self.largest_payload, self.holds, self.select_lines) + b"tactbench emulator"
                return encode_frame(Frame(Kind.HELLO.reply, frame.number, about))
            case Kind.SETUP:
                speed_hz, mode = SETUP.unpack(frame.payload)
                if mode > 3 or not speed_hz:
                    raise ValueError
                self._speed_hz = min(speed_hz, self.fastest_hz)
                return encode_frame(Frame(Kind.SETUP.reply, frame.number, SETUP.pack(self._speed_hz, mode)))
            case Kind.BATCH:
                return self._batch(frame, now_s)
        raise ValueError

    def _batch(self, frame: Frame, now_s: float) -> bytes:
        if len(self._due) >= self.holds:
            return encode_frame(Frame(Kind.ERROR.reply, frame.number, FULL))
        steps = list(_steps(frame.payload))
        if not (self._speed_hz and steps) or any(select & ~self.select_lines for select, _, _ in steps):
            raise ValueError
        begin_s = t_s = max(now_s, self._free_s)
        payload = BEGIN.pack(int(begin_s * 1e6) & 0xFFFFFFFF)
        for select, pause_us, data in steps:
            if data:
                payload += self.exchange(select, data, t_s)
            t_s += 8 * len(data) / self._speed_hz + pause_us * 1e-6
        self._free_s = t_s
        reply = encode_frame(Frame(Kind.BATCH.reply, frame.number, payload))
        if "damaged" in self.faults:
            reply = bytes([reply[0], reply[1] ^ 0x80]) + reply[2:]
        times = 0 if "dropped" in self.faults else 2 if "doubled" in self.faults else 1
        self._due.append((t_s, times * reply))
        return b""


def _steps(payload: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Yield select mask, pause [us] and bytes of each step; raises ValueError or struct.error for a short step."""
    while payload:
        select, pause_us, length = STEP.unpack_from(payload)
        data, payload = payload[STEP.size : STEP.size + length], payload[STEP.size + length :]
        if len(data) < length:
            raise ValueError
        yield select, pause_us, data
