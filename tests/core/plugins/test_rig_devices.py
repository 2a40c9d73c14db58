"""From a rig file to emulators and drivers."""

import json
import time
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import numpy as np
import pytest

from tactbench.core.errors import LinkError, UnknownNameError, UsageError
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.rig_file import DeviceEntry
from tactbench.plugin.devices import EmulatedDevices, RigFile, drivers_of, emulation_of, emulators_of
from tests.core.plugins import talking

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


@pytest.mark.parametrize(("channel", "sign"), [("fz", 1), ("fx", -1)])
def test_the_force_sensor_feels_the_pressing_force_where_its_entry_says(channel, sign):
    said = drawn(rig_file(force={"device": "scale", "link": "emulated", "channel": channel, "sign": sign}))
    assert said["pad"]["senses"] == pytest.approx({"T1": 1.0, "fz": 0.1})
    assert said["force"]["senses"] == pytest.approx({channel: 0.1 * sign})


def test_devices_draw_from_generators_of_their_own():
    """Another device, or none, changes nothing for this one; another seed does."""
    here = drawn(rig_file())
    assert here["pad"]["drawn"] != here["force"]["drawn"]
    assert drawn(rig_file(devices={})) == here
    assert drawn(rig_file(emulation={"seed": 2}))["pad"]["drawn"] != here["pad"]["drawn"]


def test_faults_of_the_link_and_its_pace_do_not_reach_the_device_and_its_own_faults_do():
    def emulated(**entry):
        return emulators_of(rig_file(sensors={"pad": {"link": "emulated", **entry}}), REGISTRY, "pad", sense)["pad"]

    device = emulated(faults=["late:delay_s=0.2", "unplug:start_s=3"], options={"baud": 9600})
    faults = [(fault.name, fault.delay_s, fault.start_s) for fault in device.faults]
    assert (faults, device.baud) == ([("late", 0.2, -np.inf), ("unplug", 0.05, 3.0)], 9600)
    with pytest.raises(UsageError, match="entry 'pad': It has no fault 'parity'"):
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
        ({}, "biotac", "biotac"),
        ({"sensors": {"pda": {"link": "emulated"}}}, "pda", "entry 'pda'.*'pad'"),
        ({"force": {"device": "scael", "link": "emulated"}}, "pad", "entry 'force'.*'scale'"),
        ({"force": {"device": "screw", "link": "emulated"}}, "pad", "no force sensor"),
        ({}, "mute", "mute has no driver"),
        ({"sensors": {"pad": {"link": "emulated", "options": {"board": 1}}}}, "pad", "entry 'pad'.*'board'"),
        ({"sensors": {"pad": {"link": "udp:/1"}}}, "pad", "entry 'pad'.*not the address"),
        # An emulated scale has its unit; of a real one nobody knows it but the rig file.
        ({"force": {"device": "scale", "link": "udp://127.0.0.1:9"}}, "pad", "entry 'force'.*option 'unit'"),
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
        with pytest.raises(LinkError, match="entry 'force': no cable"):
            drivers_of(rig_file(), REGISTRY, "pad", links, devices.clock)
        devices.open_link("pad").close()  # it can be opened only if it was closed


@pytest.mark.parametrize(
    ("entry", "said", "marked"),
    [({}, {}, False), ({"emulator": True}, {}, True), ({}, {"adapter": "tactbench EMULATOR"}, True),
     ({}, {"serial": "7"}, False)],
)  # fmt: skip
def test_emulators_that_run_elsewhere_are_marked_by_the_file_or_by_what_they_say(entry, said, marked):
    file = RigFile(rig="bench", sensors={"pad": DeviceEntry(link="udp://127.0.0.1:9", **entry)})
    emulation = emulation_of(file, {"pad": said})
    assert (emulation and (emulation.time, emulation.devices)) == (("real", ("pad",)) if marked else None)
