"""The SPI bridge as a model, fed and polled like an emulated device: bytes in, bytes out, on a clock passed in.

Also the reference for its firmware: what it answers to what, ``docs/links.md`` says in words.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from tactbench.links.bridge_frame import VERSION, Frame, FrameDecoder, Kind, encode_frame
from tactbench.links.spi_bridge import BEGIN, FULL, HELLO, SETUP, STEP

Exchange = Callable[[int, bytes, float], bytes]
"""What hangs on the bus: select mask, bytes out, second at which they begin -> as many bytes in."""


@dataclass
class BridgeEmulator:
    """A bridge with one SPI bus."""

    exchange: Exchange
    """What hangs on the bus."""
    holds: int = 4
    """Batches it can hold, the running one included."""
    largest_payload: int = 4096
    """Bytes of payload it can take."""
    select_lines: int = 0xFF
    """Mask of the lines it has."""
    fastest_hz: int = 10_000_000
    """The highest clock it can run, hertz."""
    faults: set[str] = field(default_factory=set)
    """What goes wrong now: ``dropped`` (batches are carried out, their replies are not sent), ``doubled`` (replies are
    sent twice), ``damaged`` (one bit of each reply is turned)."""

    def __post_init__(self) -> None:
        self._speed_hz = 0
        self._free_s = 0.0
        self._decoder = FrameDecoder()
        self._due: deque[tuple[float, bytes]] = deque()

    def feed(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Take bytes from the host and return what is sent by now, each piece with its second."""
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
        """Return when the next reply is due; infinite: none is."""
        return self._due[0][0] if self._due else math.inf

    def _answered(self, frame: Frame, now_s: float) -> bytes:
        if frame.version != VERSION:
            return self._refusal(frame, f"version {frame.version} is unknown")
        if len(frame.payload) > self.largest_payload:
            return self._refusal(frame, f"payload above {self.largest_payload} bytes")
        match frame.kind:
            case Kind.HELLO:
                about = HELLO.pack(VERSION, self.largest_payload, self.holds, self.select_lines) + b"tactbench emulator"
                return encode_frame(Frame(Kind.HELLO.reply, frame.number, about))
            case Kind.SETUP:
                return self._set_up(frame)
            case Kind.BATCH:
                return self._batch(frame, now_s)
        return self._refusal(frame, f"kind {frame.kind} is unknown")

    def _set_up(self, frame: Frame) -> bytes:
        if len(frame.payload) != SETUP.size:
            return self._refusal(frame, "malformed payload")
        speed_hz, mode = SETUP.unpack(frame.payload)
        if mode > 3 or not speed_hz:
            return self._refusal(frame, "clock or mode is not possible")
        self._speed_hz = min(speed_hz, self.fastest_hz)
        return encode_frame(Frame(Kind.SETUP.reply, frame.number, SETUP.pack(self._speed_hz, mode)))

    def _batch(self, frame: Frame, now_s: float) -> bytes:
        if not self._speed_hz:
            return self._refusal(frame, "not set up")
        if len(self._due) >= self.holds:
            return self._refusal(frame, FULL.decode())
        steps = _steps(frame.payload)
        if steps is None or any(select & ~self.select_lines for select, _, _ in steps):
            return self._refusal(frame, "malformed payload")
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

    @staticmethod
    def _refusal(frame: Frame, reason: str) -> bytes:
        return encode_frame(Frame(Kind.ERROR.reply, frame.number, reason.encode("ascii")))


def _steps(payload: bytes) -> list[tuple[int, int, bytes]] | None:
    """Return select, pause in us and bytes of each step; None if the payload is no list of steps."""
    steps = []
    place = 0
    while place < len(payload):
        try:
            select, pause_us, length = STEP.unpack_from(payload, place)
        except struct.error:
            return None
        place += STEP.size
        if place + length > len(payload):
            return None
        steps.append((select, pause_us, payload[place : place + length]))
        place += length
    return steps or None
