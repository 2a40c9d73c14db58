"""The devices by their names: what listings see, and drivers and emulators that fit each other."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

from tactbench.plugin import load_object, load_registry
from tactbench.plugin.devices import DriverSettings, EmulatorSettings
from tests.rigs.parallel_manipulator.pumps import VirtualLink, read_for

POINT = EntryPoint("parallel-manipulator", "tactbench.rigs.parallel_manipulator", "tactbench")


def devices():
    registry = load_registry([POINT])
    assert registry.failures == []
    return {device.name: device for device in registry.devices}


@pytest.mark.parametrize("name", ["net-ft", "faulhaber"])
def test_driver_and_emulator_take_the_same_options(name):
    descriptor = devices()[name]
    own = {"net-ft": {"rate_hz": 500.0}, "faulhaber": {"peak_current_a": 0.5}}
    options = descriptor.emulated_options | own[name]

    def senses(time_s):
        return {} if time_s < 100.5 else {"fz": -2.0}

    def block_of_a_second():
        emulator = load_object(descriptor.emulator)(EmulatorSettings(senses, np.random.default_rng(3), options))
        link = VirtualLink(emulator)
        with load_object(descriptor.driver)(DriverSettings(lambda: link, options=options, clock=link.clock)) as driver:
            assert driver.identify()
            driver.start()
            block = read_for(driver, link, 2.0)
            assert [stream.name for stream in driver.streams] == [block.stream]
            assert block.data.shape[1] == len(driver.streams[0].channels)
            assert driver.counts == {}
        return block

    first, again = block_of_a_second(), block_of_a_second()
    if name != "faulhaber":
        assert first.data[-1] == pytest.approx([0, 0, -2, 0, 0, 0], abs=2e-3)
    # Virtual time: the same each time, to the bit.
    for attribute in ("t_ns", "data", "quality"):
        assert np.array_equal(getattr(first, attribute), getattr(again, attribute), equal_nan=attribute == "data")
