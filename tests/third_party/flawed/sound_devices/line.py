"""Numbered frames on a serial line: a mark, a counter of 8 bits, signed numbers, a checksum."""

import itertools
import struct
from dataclasses import replace

import numpy as np

from sound_devices import SPEC
from tactbench.plugin import ChannelSpec, Quality, StreamSpec
from tactbench.plugin.devices import ByteLink, RowDriver, RowEmulator, Sample, Unwrap

MARK, MOST_N = 0xA5, 50.0
FORCES = StreamSpec(name="force_torque", rate_hz=100.0, channels=tuple(
    ChannelSpec(name=name, kind="force", unit="N") for name in ("fx", "fy", "fz")))  # fmt: skip
PLACE = StreamSpec(name="motor", rate_hz=100.0, channels=(ChannelSpec(name="position", kind="position", unit="m"),))


class Framed(RowDriver[ByteLink]):
    """A RowDriver for numbered frames: `rows` keeps each row's number, `read` counts them on over their wraps."""

    link_kind, layout, scale = ByteLink, "h", 1.0
    _left = b""

    def identify(self):
        return {"model": "framed"}

    def begin(self):
        self._left, self._numbers, self._unwrap = b"", [], Unwrap(8)
        self.link.write(b"go")

    def rows(self, received):
        data, size = self._left + received.data, struct.calcsize(f"<{len(self.stream.channels)}{self.layout}") + 3
        while len(data) >= size:
            if data[0] != MARK or sum(data[: size - 1]) % 256 != data[size - 1]:
                data = data[1:]
                self.counted["bytes of no frame"] += 1
                continue
            self._numbers.append(data[1])
            values = struct.unpack(f"<{len(self.stream.channels)}{self.layout}", data[2 : size - 1])
            yield self.sample([self.scale * value for value in values])
            data = data[size:]
        self._left = data

    def sample(self, values):
        return Sample(values)

    def read(self, timeout_s):
        self._numbers = []
        return [replace(block, sequence=self._unwrap(self._numbers)) for block in super().read(timeout_s)]

    def quiet(self):
        self.link.write(b"stop")


class FramedEmulator(RowEmulator):
    rate_hz, layout, scale = 100.0, "h", 1.0

    def __init__(self, settings):
        super().__init__(settings)
        self._number = itertools.count()

    def sent(self, values):
        whole = [round(value / self.scale) for value in values]
        frame = struct.pack(f"<BB{len(whole)}{self.layout}", MARK, next(self._number) % 256, *whole)
        return [frame + bytes([sum(frame) % 256])]

    def told(self, piece, now_s):
        if piece in (b"go", b"stop"):
            self.sample(now_s, on=piece == b"go")
        return ()


class Pad(Framed):
    stream = SPEC.streams[0]


class PadEmulator(FramedEmulator):
    stream, from_power_on = SPEC.streams[0], True


class Scale(Framed):
    stream, layout, scale = FORCES, "i", 1e-3

    def sample(self, values):
        return Sample(values, list(np.where(np.abs(values) >= MOST_N, Quality.SATURATED, Quality.GOOD)))


class ScaleEmulator(FramedEmulator):
    stream, layout, scale = FORCES, "i", 1e-3

    def sent(self, values):
        return super().sent(np.clip(values, -MOST_N, MOST_N))


class Stage(Framed):
    stream, layout, scale = PLACE, "i", 1e-9


class StageEmulator(FramedEmulator):
    stream, layout, scale, runs = PLACE, "i", 1e-9, False

    def sensed(self, now_s):
        return [1e-3 * now_s if self.runs else 0.0]

    def told(self, piece, now_s):
        self.runs |= piece == b"run"
        return super().told(piece, now_s)
