"""Frames by the published driver's rule, and the conformance kit."""

import numpy as np
import pytest
from tactbench.plugin import Quality
from tactbench.plugin.devices import CanFrame, DriverSettings, EmulatedDevice, EmulatedDevices, EmulatorSettings
from tactbench.testing import plugin_checks

from tactbench_xela_uskin import REST
from tactbench_xela_uskin.driver import Emulator, USkinDriver, decode, encode

VECTORS = [
    ("710", "0000010002000300", 0, (1, 2, 3)),
    ("715", "0040004074465000", 5, (16384, 16500, 18000)),
    ("71E", "00123456789ABC00", 14, (4660, 22136, 39612)),
    ("71F", "00FFFFFFFFFFFF00", 15, (65535, 65535, 65535)),
    ("713", "7F3E8042684E2000", 3, (16000, 17000, 20000)),  # the first byte is not used
]


@pytest.mark.parametrize("check", plugin_checks("xela-uskin"), ids=str)
def test_conforms(check):
    check()


@pytest.mark.parametrize(("identifier", "data", "taxel", "values"), VECTORS)
def test_frames(identifier, data, taxel, values):
    frame = CanFrame(int(identifier, 16), bytes.fromhex(data))
    assert decode(frame) == (taxel, values)
    if frame.data[0] == 0:
        assert encode(taxel, values) == frame


@pytest.mark.parametrize(
    "frame", [CanFrame(0x720, bytes(8)), CanFrame(0x710, bytes(7)), CanFrame(0x710, bytes(8), True)]
)
def test_frames_of_others(frame):
    assert decode(frame) is None


class Losing(Emulator):
    """A board, some of whose frames are lost: (row, taxel)."""

    lost, number = (), -1

    def sent(self, values):
        self.number += 1
        return [frame for taxel, frame in enumerate(super().sent(values)) if (self.number, taxel) not in self.lost]


@pytest.mark.parametrize(
    ("lost", "rows"),
    [
        ({(2, 15), (3, 4)}, {2: {15}, 3: {4}}),  # the last of one row, and another one's of the next
        ({(2, 15), (3, 0), (3, 1)}, {2: {15}, 3: {0, 1}}),
        ({(2, taxel) for taxel in range(16)}, {}),
        (
            {(4, taxel) for taxel in range(8, 16)} | {(5, taxel) for taxel in range(3)},
            {4: set(range(8, 16)), 5: {0, 1, 2}},
        ),
    ],
)
def test_rows_are_of_one_cycle_each(lost, rows):
    model = Losing(EmulatorSettings(lambda second: {"t1z": 1000.0 + round(1e2 * second)}, np.random.default_rng(1)))
    model.lost = lost
    with (
        EmulatedDevices({"pad": EmulatedDevice("can", model)}) as devices,
        USkinDriver(DriverSettings(lambda: devices.open_link("pad"), clock=devices.clock)) as driver,
    ):
        driver.start()
        blocks = [block for _ in range(10) for block in driver.read(0.01)]
        counts = dict(driver.counts)
    missing = {}
    for block in blocks:
        for row, at_ns in enumerate(block.t_ns):
            marks = block.quality[row] if block.quality is not None else np.zeros(48)
            if marks.any():
                missing[round(1e-7 * at_ns) - round(1e-7 * blocks[0].t_ns[0])] = set(np.flatnonzero(marks)[::3] // 3)
    assert missing == rows
    assert counts == ({"frames lost": sum(map(len, rows.values()))} if rows else {})


class OneTaxelSilent(Emulator):
    """A board whose taxel 4 does not send."""

    def poll(self, now_s):
        return [one for one in super().poll(now_s) if one[1].id != 0x714]


def test_a_taxel_that_is_not_heard_is_missing():
    model = OneTaxelSilent(EmulatorSettings(lambda second: {"t1z": 300.0}, np.random.default_rng(1)))
    with (
        EmulatedDevices({"pad": EmulatedDevice("can", model)}) as devices,
        USkinDriver(DriverSettings(lambda: devices.open_link("pad"), clock=devices.clock)) as driver,
    ):
        driver.start()
        (block,) = driver.read(0.5)
    np.testing.assert_array_equal(block.data[0, :3], [REST, REST, 300])
    assert np.flatnonzero(block.quality[0]).tolist() == [12, 13, 14]
    assert set(block.quality[0, 12:15]) == {Quality.MISSING}
