"""What this machine has for devices, and whether those of a rig answer."""

import json
from dataclasses import asdict
from typing import ClassVar

import numpy as np
import pytest
from serial.tools.list_ports import comports

from tactbench.core.plugins.registry import Owned, Registry
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, Source, StreamSpec
from tactbench.devices.cli.device_check import check_devices, look_at_host
from tactbench.plugin.devices import Driver
from tests.conftest import Verbs

RIG = """
rig: bench
sensors:
  wired-pad: {link: "loop://"}
force: {device: wired-scale, link: "loop://"}
devices:
  motor: {device: wired-motor, link: emulated}
"""


@pytest.fixture
def doctor(tmp_path):
    """The verb, with the plugin of a pad and a scale on lines."""
    verbs = Verbs(tmp_path, here=True)
    return lambda *words, code=0: verbs("doctor", *words, code=code, plugins=("wired",)).stdout


def test_the_ports_of_this_machine_are_listed(doctor):
    here = list(look_at_host())
    about = json.loads(doctor("--format", "json", code=1 if any(one.denied for one in here) else 0))
    assert about["host"] == list(map(asdict, here))
    ports = [one["name"] for one in about["host"] if one["kind"] == "serial port"]
    assert ports == sorted(port.device for port in comports())


def test_what_is_wrong_with_the_devices_of_a_rig_file_comes_first_and_what_is_emulated_is_not_opened(tmp_path, doctor):
    (tmp_path / "rig.yaml").write_text(RIG)
    asked = ("--rig-file", "rig.yaml", "--seconds", "0.1")
    about = json.loads(doctor(*asked, "--format", "json", code=1))
    motor = about["devices"][2]
    assert (motor["emulated"], motor["identity"], motor["problems"]) == (True, {}, [])
    assert [problem.partition(":")[0] for problem in about["problems"]] == ["wired-pad", "force"]
    assert doctor(*asked, code=1).startswith(f"WRONG  {about['problems'][0]}")


TAXELS = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(3))
PAD = StreamSpec(name="taxels", rate_hz=100, channels=TAXELS)
log: list[str] = []


class Paced(Driver):
    """A pad whose reads take the time they wait: its options say its rate, and what goes wrong."""

    streams = (PAD,)
    counts: ClassVar = {"crc errors": 1}
    start, stop, close = (lambda self, name=name: log.append(name) for name in ("start", "stop", "close"))

    def __init__(self, settings):
        self.options, self.clock, self.sent = settings.options, settings.clock, 0
        self.rng = np.random.default_rng(1)

    def identify(self):
        log.append("identify")
        if self.options.get("raises"):
            raise ValueError("of somebody else")
        return {"model": "paced"}

    def read(self, timeout_s):
        rate_hz = self.options.get("rate_hz", 100)
        self.clock.now_ns += round(timeout_s * 1e9)
        rows = np.arange(self.sent, 0 if self.options.get("mute") else int(self.clock.now_ns * 1e-9 * rate_hz))
        self.sent += len(rows)
        data = 1000 + self.rng.normal(size=(len(rows), 3)) * [1, 2, 0]
        quality = np.zeros(data.shape, np.uint8)
        bad = (rows == 25) & self.options.get("bad", False)
        data[bad], quality[bad] = 1e9, Quality.MISSING
        numbers = rows + (rows >= 25) * self.options.get("lost", 0)
        block = Block("taxels", np.round(rows / rate_hz * 1e9).astype(np.int64), data, quality, sequence=numbers)
        return [block] if len(rows) else []


class VirtualClock:
    now_ns = 0
    __call__ = lambda self: self.now_ns  # noqa: E731


def checked(**options):
    """Return the check of a pad with these options, and of a motor."""
    log.clear()
    where, source = f"{__name__}:Paced", Source(tag="assumed", reference="test")
    spec = SensorSpec(name="pad", title="p", principle="p", principle_source=source, streams=(PAD,))
    registry = Registry()
    registry.sensors.add(Owned(SensorDescriptor(spec=spec, driver=where), "m", "d", "1"))
    registry.devices.add(Owned(DeviceDescriptor(name="axis", title="a", kind="motor", driver=where), "m", "d", "1"))
    sensors = {"pad": {"link": "loop://", "options": options}}
    motor = {"motor": {"device": "axis", "link": "loop://"}}
    rig = RigFile.model_validate({"rig": "bench", "sensors": sensors, "devices": motor})
    return check_devices(rig, registry, seconds=3, clock=VirtualClock())


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"rate_hz": 90}, "90 Hz"),
        ({"rate_hz": 99}, ""),
        ({"bad": True}, "1 MISSING"),
        ({"lost": 10}, "10 lost"),
        ({"mute": True}, "taxels"),
    ],
)
def test_what_a_stream_lacks_is_told(options, says):
    pad, motor = checked(**options)
    assert says in "".join(pad.problems)
    assert bool(says) == bool(pad.problems)
    assert (pad.identity, pad.counts, motor.identity) == ({"model": "paced"}, Paced.counts, {"model": "paced"})
    for stream in pad.streams:  # of 300 values: a standard error of 4 %; samples that are missing are in no noise
        assert stream["sd_largest"] == pytest.approx(2, rel=0.15)
        assert (stream["noisiest"], stream["constant"]) == ("t1", ["t2"])
        assert stream["mean"] == pytest.approx(1000, abs=0.2)
        assert stream["lost"] == options.get("lost", 0)
    assert log == ["identify", "start", "stop", "close", "identify", "close"], "a motor is not started"


def test_a_driver_of_others_that_raises_anything_is_closed_and_told():
    pad, motor = checked(raises=True)
    assert "ValueError" in pad.problems[0]
    assert log[:2] == ["identify", "close"]
    assert motor.identity == {"model": "paced"}
