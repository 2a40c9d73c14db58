"""The SPI bridge as a model, fed and polled like an emulated device: bytes in, bytes out, on a clock passed in.

It is the reference for the firmware, which ``docs/links.md`` specifies.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from tactbench.links.spi_bridge import BEGIN, FULL, HELLO, SETUP, STEP, VERSION, Frame, FrameDecoder, Kind, encode_frame

Exchange = Callable[[int, bytes, float], bytes]
"""A device on the bus: select mask, bytes out, second at which they begin -> as many bytes in."""


@dataclass
class BridgeEmulator:
    """A bridge with one SPI bus."""

    exchange: Exchange
    """The device on the bus."""
    holds: int = 4
    """Batches it can hold, the running one included."""
    largest_payload: int = 4096
    """Bytes of payload it can take."""
    select_lines: int = 0xFF
    """Mask of its select lines."""
    fastest_hz: int = 10_000_000
    """Its highest clock, hertz."""
    faults: set[str] = field(default_factory=set)
    """Present faults: ``dropped`` (batches run, their replies are not sent), ``doubled`` (replies are sent twice),
    ``damaged`` (one bit of each reply is inverted)."""

    def __post_init__(self) -> None:
        self._speed_hz = 0
        self._free_s = 0.0
        self._decoder = FrameDecoder()
        self._due: deque[tuple[float, bytes]] = deque()

    def feed(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Take bytes from the host and return the pieces sent by now, each with its second."""
        out = self.poll(now_s)
        out += [(now_s, answer) for frame in self._decoder.feed(data) if (answer := self._answered(frame, now_s))]
        return out + self.poll(now_s)

    def poll(self, now_s: float) -> list[tuple[float, bytes]]:
        """Return the replies to batches that are over by `now_s`, each with the second at which its batch was over."""
        out = []
        while self._due and self._due[0][0] <= now_s:
            t_s, reply = self._due.popleft()
            if reply:
                out.append((t_s, reply))
        return out

    def next_s(self) -> float:
        """Return the time of the next reply; infinite: none is due."""
        return self._due[0][0] if self._due else math.inf

    def _answered(self, frame: Frame, now_s: float) -> bytes:
        try:
            return self._executed(frame, now_s)
        except (ValueError, struct.error):
            return encode_frame(Frame(Kind.ERROR.reply, frame.number, b"malformed or not possible"))

    def _executed(self, frame: Frame, now_s: float) -> bytes:
        """Return the reply, empty where it is sent later; raises ValueError or struct.error for a refused request."""
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
    """Yield select, pause in us and bytes of each step; raises ValueError or struct.error if they are not whole."""
    while payload:
        select, pause_us, length = STEP.unpack_from(payload)
        data, payload = payload[STEP.size : STEP.size + length], payload[STEP.size + length :]
        if len(data) < length:
            raise ValueError
        yield select, pause_us, data
