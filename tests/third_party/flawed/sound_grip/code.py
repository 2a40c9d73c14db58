"""Force on the cells that are nearest to each place; frames with a counter of 16 bits and microseconds of 32."""

import itertools
import struct
from dataclasses import replace

import numpy as np

from sound_grip import SPEC
from tactbench.plugin.devices import ByteLink, RowDriver, RowEmulator, Sample, Unwrap

MARK, FRAME = 0xA5, struct.Struct("<BHI12h")


def build(sensor, grid, channel_names):
    area = grid.cell_mm[0] * grid.cell_mm[1]
    sites = {one.name: one.position_m for one in sensor.channels("taxel")}
    places = np.array(sorted(set(sites.values())))[:, :2] * 1e3
    apart = np.hypot(grid.x_mm[:, None, None] - places[:, 0], grid.s_mm[None, :, None] - places[:, 1])
    nearest = apart.argmin(axis=2)
    numbers = {tuple(place): number for number, place in enumerate(places)}

    def read(state):
        parts = {"x": state.shear_mpa[0], "y": state.shear_mpa[1], "z": state.pressure_mpa}
        found = []
        for name in channel_names:
            x, y, _ = sites[name]
            found.append(area * parts[name[0]][nearest == numbers[(x * 1e3, y * 1e3)]].sum())
        return np.array(found)

    return read


class Grip(RowDriver[ByteLink]):
    stream, link_kind, _left = SPEC.streams[0], ByteLink, b""

    def begin(self):
        self._left, self._number, self._time = b"", Unwrap(16), Unwrap(32)
        self.link.write(b"go")

    def quiet(self):
        self.link.write(b"stop")

    def rows(self, received):
        data, size = self._left + received.data, FRAME.size + 1
        while len(data) >= size:
            if data[0] != MARK or sum(data[: size - 1]) % 256 != data[size - 1]:
                data = data[1:]
                self.counted["bytes of no frame"] += 1
                continue
            _, number, microseconds, *values = FRAME.unpack(data[: size - 1])
            self._stamps.append((number, microseconds))
            yield Sample([1e-3 * value for value in values])
            data = data[size:]
        self._left = data

    def read(self, timeout_s):
        self._stamps = []
        blocks = super().read(timeout_s)
        numbers, times = np.array(self._stamps, np.int64).reshape(-1, 2).T
        return [replace(block, sequence=self._number(numbers), device_ns=1000 * self._time(times)) for block in blocks]


class GripEmulator(RowEmulator):
    stream, rate_hz = SPEC.streams[0], 200.0

    def __init__(self, settings):
        super().__init__(settings)
        self._numbers = itertools.count()

    def sensed(self, now_s):
        self._now_s = now_s
        return super().sensed(now_s)

    def sent(self, values):
        whole = [round(1e3 * value) for value in values]
        frame = FRAME.pack(MARK, next(self._numbers) % 65536, round(1e6 * self._now_s) % 2**32, *whole)
        return [frame + bytes([sum(frame) % 256])]

    def told(self, piece, now_s):
        if piece in (b"go", b"stop"):
            self.sample(now_s, on=piece == b"go")
        return ()
