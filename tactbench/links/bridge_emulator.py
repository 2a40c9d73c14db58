"""Emulator of the SPI bridge, which like an emulated device takes and returns bytes at times given by the caller.

The emulator is the reference for the bridge's firmware, which ``docs/links.md`` specifies.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from tactbench.links.spi_link import BEGIN, FULL, HELLO, SETUP, STEP, VERSION, Frame, FrameDecoder, Kind, encode_frame

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

    def __post_init__(self) -> None:
        self._speed_hz = 0
        self._free_s = 0.0
        self._decoder = FrameDecoder()
        self._due: deque[tuple[float, bytes]] = deque()

    def feed(self, data: bytes, now_s: float) -> list[tuple[float, bytes]]:
        """Take bytes from the host and return the replies sent until `now_s`, each with its time of sending [s]."""
        out = self.poll(now_s)
        for frame in self._decoder.feed(data):
            kind = frame.kind | 0x80
            try:
                payload = self._executed(frame, now_s)
            except (ValueError, struct.error) as refusal:
                kind, payload = Kind.ERROR.reply, str(refusal).encode()
            if payload is not None:
                out.append((now_s, encode_frame(Frame(kind, frame.number, payload))))
        return out + self.poll(now_s)

    def poll(self, now_s: float) -> list[tuple[float, bytes]]:
        """Return the replies to batches finished by `now_s`, each with the time at which its batch finished [s]."""
        out = []
        while self.next_s() <= now_s:
            out.append(self._due.popleft())
        return out

    def next_s(self) -> float:
        """Return the time of the next reply to a batch [s]; infinite: no batch is running."""
        return self._due[0][0] if self._due else math.inf

    def _executed(self, frame: Frame, now_s: float) -> bytes | None:
        """Return the reply's payload, None if sent later; raises ValueError or struct.error to refuse the request."""
        if frame.version != VERSION or len(frame.payload) > self.largest_payload:
            raise ValueError("version is unknown, or payload is too large")
        match Kind(frame.kind):
            case Kind.HELLO:
                return HELLO.pack(VERSION, self.largest_payload, self.holds, self.select_lines) + b"tactbench emulator"
            case Kind.SETUP:
                speed_hz, mode = SETUP.unpack(frame.payload)
                if mode > 3 or not speed_hz:
                    raise ValueError("clock or mode is not possible")
                self._speed_hz = min(speed_hz, self.fastest_hz)
                return SETUP.pack(self._speed_hz, mode)
            case Kind.BATCH:
                self._run(frame, now_s)
                return None
        raise ValueError("kind is unknown")

    def _run(self, frame: Frame, now_s: float) -> None:
        """Run a batch after the batches received earlier."""
        if len(self._due) >= self.holds:
            raise ValueError(FULL.decode())
        steps, rest = [], frame.payload
        while rest:
            select, pause_us, length = STEP.unpack_from(rest)
            data, rest = rest[STEP.size : STEP.size + length], rest[STEP.size + length :]
            if len(data) < length or select & ~self.select_lines:
                raise ValueError("malformed payload")
            steps.append((select, pause_us, data))
        if not (self._speed_hz and steps):
            raise ValueError("not set up, or malformed payload")
        t_s = max(now_s, self._free_s)
        payload = BEGIN.pack(int(t_s * 1e6) & 0xFFFFFFFF)
        for select, pause_us, data in steps:
            if data:
                payload += self.exchange(select, data, t_s)
            t_s += 8 * len(data) / self._speed_hz + pause_us * 1e-6
        self._free_s = t_s
        self._due.append((t_s, encode_frame(Frame(Kind.BATCH.reply, frame.number, payload))))
