"""Drivers and emulators of one stream: rows with times and quality, options and links refused, the device gone."""

import re
import sys
from types import ModuleType

import numpy as np
import pytest

from tactbench.devices.emulator import LinkFault
from tactbench.plugin import ChannelSpec, Quality, StreamSpec, UsageError, assumed
from tactbench.plugin.devices import (
    ByteLink,
    CanFrame,
    CanLink,
    DriverSettings,
    EmulatedDevice,
    EmulatedDevices,
    EmulatorSettings,
    LinkUnplugged,
    Options,
    RowDriver,
    RowEmulator,
    Sample,
)
from tests.conftest import ROOT

STREAM = StreamSpec(
    name="taxels", dtype="uint8",
    channels=tuple(ChannelSpec(name=f"t{n}", kind="taxel", lower=0, upper=255, rest=assumed(n, "count", "a test"))
                   for n in range(3)),
)  # fmt: skip


class UnitOptions(Options):
    unit: int = 1


class ByteDriver(RowDriver[ByteLink]):
    stream, link_kind, options_kind = STREAM, ByteLink, UnitOptions

    def begin(self):
        self.link.write(b"+")

    def quiet(self):
        self.link.write(b"-")

    def rows(self, received):
        for start in range(0, len(received.data), 3):
            row = received.data[start : start + 3]
            yield Sample(list(row), [Quality.SATURATED if value == 255 else Quality.GOOD for value in row])


class ByteModel(RowEmulator):
    stream, rate_hz = STREAM, 100.0

    def sent(self, values):
        return [bytes(map(round, values))]

    def told(self, piece, now_s):
        self.sample(now_s, on=piece == b"+")
        return ()


class CanDriver(RowDriver[CanLink]):
    stream, link_kind = STREAM, CanLink

    def rows(self, received):
        return [Sample(list(received.data))]


class CanModel(RowEmulator):
    stream, rate_hz, from_power_on = STREAM, 100.0, True

    def sent(self, values):
        return [CanFrame(1, bytes(map(round, values)))]


def settings(senses=lambda second: {}, faults=()):
    return EmulatorSettings(senses, np.random.default_rng(1), faults=faults)


def on(devices, driver, **options):
    return driver(DriverSettings(lambda: devices.open_link("pad"), options=options, clock=devices.clock))


def test_rows_have_times_values_and_quality():
    model = ByteModel(settings(lambda second: {"t0": 255.0 if second > 0.525 else 7.0}))
    with EmulatedDevices({"pad": EmulatedDevice("bytes", model)}) as devices, on(devices, ByteDriver) as driver:
        assert driver.streams == (STREAM,)
        assert driver.read(0.5) == []  # nothing before it is started
        began_ns = devices.clock()
        driver.start()
        blocks = [driver.read(0.5)[0] for _ in range(3)]
        driver.stop()
        assert driver.read(0.5) == []
        assert driver.counts == {}
    np.testing.assert_array_equal(np.concatenate([block.data for block in blocks]), [[7, 1, 2], [7, 1, 2], [255, 1, 2]])
    times = np.concatenate([block.t_ns for block in blocks]) - began_ns
    np.testing.assert_allclose(times, [10e6, 20e6, 30e6], atol=1)  # rounded to nanoseconds
    assert blocks[0].data.dtype == np.uint8
    assert [block.quality for block in blocks[:2]] == [None, None]
    assert blocks[2].quality.tolist() == [[Quality.SATURATED, 0, 0]]


def test_frames_that_wait_are_one_block():
    with EmulatedDevices({"pad": EmulatedDevice("can", CanModel(settings()))}) as devices:
        with on(devices, CanDriver) as driver:
            assert driver.read(0) == []
            devices.advance(55_000_000)
            (block,) = driver.read(0)
        assert block.data.tolist() == [[0, 1, 2]] * 5
        assert block.quality is None


def test_what_came_before_it_was_unplugged_is_handed_out():
    device = EmulatedDevice("can", CanModel(settings()), faults=(LinkFault.parse("unplug:start_s=0.025"),))
    with EmulatedDevices({"pad": device}) as devices, on(devices, CanDriver) as driver:
        devices.advance(1_000_000_000)  # the frames at 10 and 20 ms have come, and the cable is pulled
        assert driver.read(0.5)[0].data.tolist() == [[0, 1, 2]] * 2
        with pytest.raises(LinkUnplugged):
            driver.read(0.5)
        driver.stop()  # raises nothing


def test_an_unknown_option_and_a_link_of_another_kind_are_refused_and_the_link_is_free():
    for kind, model, options, named in (("bytes", ByteModel, {"unti": 2}, "unti"), ("can", CanModel, {}, "ByteDriver")):
        with EmulatedDevices({"pad": EmulatedDevice(kind, model(settings()))}) as devices:
            with pytest.raises(UsageError, match=named):
                on(devices, ByteDriver, **options)
            devices.open_link("pad").close()


class AskedDriver(ByteDriver):
    def ask(self):
        self.link.write(b"?")


class AskedModel(RowEmulator):
    stream, answer_s = STREAM, 0.004

    def sent(self, values):
        return [bytes(map(round, values))]

    def told(self, piece, now_s):
        return self.sent(self.sensed(now_s)) if piece == b"?" else []


def test_an_answer_takes_its_time():
    with EmulatedDevices({"pad": EmulatedDevice("bytes", AskedModel(settings()))}) as devices:
        with on(devices, AskedDriver) as driver:
            times = [driver.read(0.5)[0].t_ns[0] for _ in range(3)]
        np.testing.assert_allclose(np.diff(times), 4e6, atol=1)  # rounded to nanoseconds


def test_the_driver_that_the_page_shows(monkeypatch):
    page = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
    for name in ("acme_tactile", "acme_line"):
        (code,) = re.findall(rf"```python\n# {name}(?:/__init__)?\.py[^\n]*\n(.*?)```", page, re.DOTALL)
        module = ModuleType(name)
        monkeypatch.setitem(sys.modules, name, module)
        exec(code, vars(module))
    model = module.AcmeEmulator(settings(lambda second: {"t1": 300.0}))
    with EmulatedDevices({"pad": EmulatedDevice("bytes", model)}) as devices, on(devices, module.AcmeDriver) as driver:
        devices.advance(35_000_000)
        (block,) = driver.read(0)
    assert block.data.tolist() == [[0, 300, 0, 0]] * 3


def test_what_its_link_counts_is_counted_too_and_rows_may_have_a_time_of_their_own():
    class Earlier(CanDriver):
        def rows(self, received):
            return [Sample(list(received.data), t_ns=received.t_ns - 7)]

    with (
        EmulatedDevices({"pad": EmulatedDevice("can", CanModel(settings()))}) as devices,
        on(devices, Earlier) as driver,
    ):
        driver.link.counts["unreadable frames"] += 2
        driver.counted["other frames"] += 1
        assert driver.counts == {"unreadable frames": 2, "other frames": 1}
        driver.start()
        (block,) = driver.read(0.05)
    assert block.t_ns.tolist() == [9_999_993]
