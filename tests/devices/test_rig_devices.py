"""From a rig file to emulators and drivers."""

import json
import time
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import numpy as np
import pytest

from tactbench.core.errors import LinkError, RigError, UnknownNameError, UsageError
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.rig_file import ForceEntry
from tactbench.plugin import Block, ChannelSpec, Quality, StreamSpec
from tactbench.plugin.devices import (
    EmulatedDevices,
    PressingForce,
    RigFile,
    drivers_of,
    emulators_of,
)
from tests.devices import talking

REGISTRY = load_registry([EntryPoint("talking", talking.HERE, "tactbench")])


def rig_file(**changed):
    said = {
        "rig": "bench",
        "sensors": {"pad": {"link": "emulated"}, "mute": {"link": "emulated"}},
        "force": {"device": "scale", "link": "emulated"},
        "devices": {"motor": {"device": "screw", "link": "emulated"}},
    }
    return RigFile.model_validate({**said, **changed})


def sense(t_s):
    return {"T1": 100 * t_s, "fz": 10 * t_s}


def drawn(file):
    """Return what each emulated device says first."""
    said = {}
    with EmulatedDevices(emulators_of(file, REGISTRY, "pad", sense)) as devices:
        for name in ("pad", "force"):
            with devices.open_link(name) as link:
                said[name] = json.loads(link.receive(1.0).data)
    return said


def test_the_force_sensor_feels_the_pressing_force_where_its_entry_says():
    said = drawn(rig_file(force={"device": "scale", "link": "emulated", "channel": "fx", "sign": -1}))
    assert said["pad"]["senses"] == pytest.approx({"T1": 1.0, "fz": 0.1})
    assert said["force"]["senses"] == pytest.approx({"fx": -0.1})


def test_devices_draw_from_generators_of_their_own():
    """Another device, or none, changes nothing for this one; another seed does."""
    here = drawn(rig_file())
    assert here["pad"]["drawn"] != here["force"]["drawn"]
    assert drawn(rig_file(devices={})) == here
    assert drawn(rig_file(emulation={"seed": 2}))["pad"]["drawn"] != here["pad"]["drawn"]


def test_faults_of_the_link_do_not_reach_the_device_and_its_own_faults_do():
    def emulated(**entry):
        return emulators_of(rig_file(sensors={"pad": {"link": "emulated", **entry}}), REGISTRY, "pad", sense)["pad"]

    device = emulated(faults=["late:delay_s=0.2", "unplug:start_s=3"])
    faults = [(fault.name, fault.delay_s, fault.start_s) for fault in device.faults]
    assert faults == [("late", 0.2, -np.inf), ("unplug", 0.05, 3.0)]
    with pytest.raises(UsageError, match=r"'pad'.*'parity'"):
        emulated(faults=["parity"])


def test_drivers_read_what_the_emulators_sense():
    file = rig_file()
    with EmulatedDevices(emulators_of(file, REGISTRY, "pad", sense)) as devices:
        links = {name: devices.opener(name) for name in ("pad", "force")}
        drivers = drivers_of(file, REGISTRY, "pad", links, devices.clock)
        with drivers["pad"] as pad, drivers["force"] as force:
            assert pad.streams == REGISTRY.sensors["pad"].spec.streams
            assert [stream.name for stream in force.streams] == ["scale"]
            (sensed,), (felt,) = pad.read(1.0), force.read(0.0)
        assert (sensed.t_ns.tolist(), felt.t_ns.tolist()) == ([10_000_000], [10_000_000])
        assert (sensed.data[0, 0], felt.data[0, 0]) == pytest.approx((1.0, 0.1))


@pytest.mark.parametrize(
    ("changed", "sensor", "said"),
    [
        ({"sensors": {"pda": {"link": "emulated"}}}, "pda", "entry 'pda'.*'pad'"),
        ({"force": {"device": "scael", "link": "emulated"}}, "pad", "entry 'force'.*'scale'"),
        ({}, "mute", "mute"),
        # An emulated scale has its unit; of a real one nobody knows it but the rig file.
        ({"force": {"device": "scale", "link": "udp://127.0.0.1:9"}}, "pad", "'force'.*'unit'"),
    ],
)
def test_errors_of_drivers_name_the_entry_and_the_next_step(changed, sensor, said):
    links = dict.fromkeys(("pad", "force"), lambda: SimpleNamespace(close=lambda: None))
    with pytest.raises((UsageError, UnknownNameError), match=said):
        drivers_of(rig_file(**changed), REGISTRY, sensor, links, time.monotonic_ns)


def test_what_was_opened_is_closed_when_a_later_device_fails():
    def fails():
        raise LinkError("no cable")

    with EmulatedDevices(emulators_of(rig_file(), REGISTRY, "pad", sense)) as devices:
        links = {"pad": devices.opener("pad"), "force": fails}
        with pytest.raises(LinkError, match="'force'"):
            drivers_of(rig_file(), REGISTRY, "pad", links, devices.clock)
        devices.open_link("pad").close()  # it can be opened only if it was closed


SCALE = StreamSpec(
    name="wrench",
    rate_hz=1000.0,
    channels=(ChannelSpec(name="fz", kind="force", unit="N"), ChannelSpec(name="tz", kind="torque", unit="N*m")),
)


def zeroed(fz, tz=0.0, quality=None, **entry):
    """Return the zero of two seconds of readings, and what a recording says of it."""
    t_s = np.arange(2000) / 1000
    data = np.column_stack([fz(t_s), np.broadcast_to(tz, t_s.shape)])
    force = PressingForce(ForceEntry(device="scale", link="emulated", **entry), (SCALE,))
    force.take_zero([Block("wrench", np.round(1e9 * t_s).astype(np.int64), data, quality)])
    return force.zero, force.about()


def noise(sd):
    return sd * np.random.default_rng(1).standard_normal(2000)


def test_a_zero_is_the_mean_of_a_sensor_at_rest_and_its_rows_are_counted():
    broken = np.zeros((2000, 2), np.uint8)
    broken[5] = Quality.SATURATED

    def reading(t_s):
        fz = 0.3 + noise(0.02)
        fz[:20] = np.nan  # one NaN made the whole zero NaN
        return fz

    zero, about = zeroed(reading, 0.1, broken)
    assert zero == pytest.approx([0.3, 0.1], abs=0.005)
    # The marked row is one of the twenty.
    assert [int(one) for one in about["zero rows of wrench"].split() if one.isdigit()] == [2000, 2, 20]


@pytest.mark.parametrize(
    ("reading", "entry", "says"),
    [
        (lambda t_s: 4.09 + noise(0.02), {}, r"fz .* 4\.09 N"),  # a hand on it
        (lambda t_s: 1.0 * t_s + noise(0.02), {}, r"fz .* 1\.34 N"),
        (lambda t_s: noise(0.1), {"noise_n": 0.02}, r"fz .* 0\.101 N"),
        (lambda t_s: np.where(t_s < 0.5, np.nan, 0.0), {}, "2000 rows.* 500"),
    ],
)
def test_a_sensor_that_is_not_at_rest_gets_no_zero(reading, entry, says):
    with pytest.raises(RigError, match=says):
        zeroed(reading, **entry)


def test_noise_that_is_held_for_several_rows_is_no_drift():
    """As the paper's force through an emulated sensor: 0.69 N at 83 Hz, read at 1 kHz."""
    rng = np.random.default_rng(2)
    for _ in range(40):
        held = np.repeat(rng.normal(0.0, 0.69, 167), 12)[:2000]
        zero, _ = zeroed(lambda t_s, held=held: held + rng.normal(0.0, 1e-3, 2000))
        assert zero[0] == pytest.approx(held.mean(), abs=1e-3)


def test_what_is_allowed_of_a_zero_is_the_rig_files():
    assert zeroed(lambda t_s: 4.09 + noise(0.02), largest_zero_n=5.0)[0][0] == pytest.approx(4.09, abs=0.01)
    assert zeroed(lambda t_s: 4.09 + t_s, zero_s=0.0)[0].tolist() == [0.0, 0.0]  # the device keeps its own
