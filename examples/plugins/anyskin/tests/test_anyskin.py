"""The frames of the published reader, and the conformance kit."""

import struct

import numpy as np
import pytest
from tactbench.plugin import Quality
from tactbench.plugin.devices import DriverSettings, EmulatedDevice, EmulatedDevices, EmulatorSettings
from tactbench.testing import plugin_checks

from tactbench_anyskin.driver import FLOATS, SIZE, AnySkinDriver, Emulator, decode, encode

# 8.0024538 begins with the bytes 0D 0A: a terminator inside a frame.
TRAP = struct.unpack("<f", bytes.fromhex("0D0A0041"))[0]


@pytest.mark.parametrize("check", plugin_checks("anyskin"), ids=str)
def test_conforms(check):
    check()


def test_a_frame_is_twenty_floats_and_a_line_end():
    first = encode([25.5, -100.25, 50.125, 812.75, *[0.0] * 16])
    assert len(first) == SIZE == 82
    assert first[:16] == bytes.fromhex("0000CC41 0080C8C2 00804842 00304B44")
    assert first[-2:] == b"\r\n"


@pytest.mark.parametrize("lost", [0, 1, 7, 81])
def test_it_gets_into_step_after_any_beginning(lost):
    rows = np.arange(10)[:, None] + np.full(FLOATS, TRAP, dtype=np.float32)
    found, rest, skipped = decode(b"".join(map(encode, rows))[lost:])
    assert len(found) == (10 if lost == 0 else 9)
    np.testing.assert_array_equal(found[-1], rows[-1].astype(np.float32))
    assert (rest, skipped) == (b"", (-lost) % SIZE)


@pytest.mark.parametrize(("reading", "mark"), [(1e38, Quality.SUSPECT), (-60_000.0, Quality.SUSPECT), (np.inf, Quality.SUSPECT),
                                               (np.nan, Quality.SUSPECT | Quality.MISSING), (-50_000.0, 0)])  # fmt: skip
def test_what_no_chip_can_read_is_marked_and_counted(reading, mark):
    model = Emulator(EmulatorSettings(lambda second: {"m2z": reading}, np.random.default_rng(1)))
    with (
        EmulatedDevices({"pad": EmulatedDevice("bytes", model)}) as devices,
        AnySkinDriver(DriverSettings(lambda: devices.open_link("pad"), clock=devices.clock)) as driver,
    ):
        driver.start()
        (block,) = driver.read(0.5)
        counted = driver.counts.get("readings that no chip has", 0)
    marks = np.zeros(block.data.shape) if block.quality is None else block.quality
    assert marks[:, 7].tolist() == [mark] * len(marks)
    assert not np.delete(marks, 7, axis=1).any()
    assert counted == (len(marks) if mark else 0)
