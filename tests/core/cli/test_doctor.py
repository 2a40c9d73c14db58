"""What this machine has for devices, and whether those of a rig answer."""

import json
import sys
import threading
from contextlib import contextmanager
from typing import ClassVar

import numpy as np
import pytest
from serial.tools.list_ports import comports

from tactbench.core.cli.device_check import check_devices
from tactbench.core.cli.host_devices import look_at_host
from tactbench.core.plugins.registry import Owned, Registry
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, Source, StreamSpec
from tactbench.plugin.devices import Driver
from tests.core.cli.terminals import ROOT
from tests.links.ends import pty

WIRED = ROOT / "tests" / "third_party" / "wired"
RIG = """
rig: bench
sensors:
  wired-pad: {{link: "serial://{pad}?baud=115200"}}
force: {{device: wired-scale, link: "serial://{scale}?baud=115200"}}
devices:
  motor: {{device: wired-motor, link: emulated}}
"""


@pytest.fixture
def doctor_here(verbs, monkeypatch):
    """The verb in this process, with the plugin of a pad and a scale on lines."""
    monkeypatch.syspath_prepend(str(WIRED))
    yield lambda *arguments, code=0: verbs("doctor", *arguments, code=code)
    for name in [name for name in sys.modules if name.partition(".")[0] == "wired_tactile"]:
        del sys.modules[name]


@contextmanager
def talking(samples):
    """The far end of a line: a device that says who it is, and sends its samples once it is started."""
    with pty() as line:
        stop = threading.Event()

        def talk():
            while not stop.is_set():
                try:
                    for word in line.read(0.05).split():
                        line.write({b"id": b"pad-3000 0815\n", b"go": samples, b"stop": b""}[word])
                except OSError:  # nobody has the line open, or no longer
                    continue

        thread = threading.Thread(target=talk)
        thread.start()
        try:
            yield line
        finally:
            stop.set()
            thread.join()


def test_what_does_not_work_comes_first_and_what_works_in_one_line(doctor_here, monkeypatch):
    monkeypatch.setattr("tactbench.core.cli.host_devices.SLEEPS", 5)
    code = 1 if any(one.state == "denied" for one in look_at_host()) else 0
    *before, last = doctor_here(code=code).stdout.splitlines()
    assert last.startswith("works ")
    assert all(line.startswith(("WRONG ", "missing ")) for line in before)
    about = json.loads(doctor_here("--format", "json", code=code).stdout)
    named = {(one["kind"], one["name"]): one for one in about["host"]}
    assert [name for kind, name in named if kind == "serial port"] == sorted(port.device for port in comports())
    assert "sleeps of 5 ms end" in named["clock", "clock"]["text"]
    offered = {"dask", "fast", "mcap", "multicast", "parquet", "spi", "wavelets", "xlsx"}
    assert {name for kind, name in named if kind == "extra"} == offered


def test_a_rig_on_lines_is_opened_asked_and_read(tmp_path, doctor_here):
    pad = b"".join(b"%d %d 500\n" % (n, 100 + n % 2) for n in range(50)) + b"nonsense here\n60 100 500\n"
    scale = b"".join(b"%d %.2f\n" % (n, 0.25 + 0.01 * (-1) ** n) for n in range(40))
    with talking(pad) as one, talking(scale) as other:
        (tmp_path / "rig.yaml").write_text(RIG.format(pad=one.name, scale=other.name))
        asked = ("--rig-file", "rig.yaml", "--seconds", "0.5")
        done = doctor_here(*asked, "--format", "json", code=1)
        shown = doctor_here(*asked, code=1).stdout
    about = json.loads(done.stdout)
    sensor, force, motor = about["devices"]
    assert sensor["identity"] == force["identity"] == {"model": "pad-3000", "serial": "0815"}
    (taxels,) = sensor["streams"]
    assert (taxels["rows"], taxels["lost"]) == (51, 10)
    assert (taxels["noisiest"], taxels["constant"], taxels["mean"]["t2"]) == ("t1", ["t2"], 500)
    assert sensor["counts"] == {"lines that are no samples": 1}
    (fz,) = force["streams"]
    assert (fz["kind"], fz["unit"]) == ("force", "N")
    assert fz["mean"]["fz"] == pytest.approx(0.25)
    assert fz["sd_median"] == pytest.approx(0.01 * np.sqrt(40 / 39))
    assert (motor["emulated"], motor["identity"]) == (True, {}), "what is emulated is not opened"
    (problem,) = about["problems"]
    assert problem.startswith("wired-pad: Stream taxels, of 51 rows: 10 lost")
    assert shown.startswith(f"WRONG    {problem}")


TAXELS = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(3))
PAD = StreamSpec(name="taxels", rate_hz=100, channels=TAXELS)
log: list[str] = []


class Paced(Driver):
    """A pad whose reads take the time they wait: its options say its rate, and what goes wrong."""

    streams = (PAD,)
    counts: ClassVar = {}
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
        block = Block("taxels", np.round(rows / rate_hz * 1e9).astype(np.int64), data, quality, sequence=rows)
        return [block] if len(rows) else []


class VirtualClock:
    now_ns = 0
    __call__ = lambda self: self.now_ns  # noqa: E731


def checked(**options):
    """Return the check of a pad with these options, and what was done to it."""
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
        ({"rate_hz": 90}, "came at 90 Hz, stated are 100 Hz"),
        ({"rate_hz": 99}, ""),
        ({"bad": True}, "of 300 rows: 1 MISSING"),
        ({"mute": True}, "Nothing came of its stream taxels within 3 s"),
    ],
)
def test_what_a_stream_lacks_is_told(options, says):
    pad, _ = checked(**options)
    assert says in "".join(pad.problems)
    assert bool(says) == bool(pad.problems)
    for stream in pad.streams:  # of 300 values: a standard error of 4 %; samples that are missing are in no noise
        assert stream["sd_largest"] == pytest.approx(2, rel=0.15)
    assert log == ["identify", "start", "stop", "close", "identify", "close"], "a motor is not started"


def test_a_driver_of_others_that_raises_anything_is_closed_and_told():
    pad, motor = checked(raises=True)
    assert "raised ValueError: of somebody else" in pad.problems[0]
    assert log[:2] == ["identify", "close"]
    assert motor.identity == {"model": "paced"}
