"""What this machine has for devices, and whether those of a rig answer."""

import json
import os
import subprocess
import sys
import threading
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from serial.tools.list_ports import comports

from tactbench.core.cli.device_check import check_devices
from tactbench.core.cli.host_devices import extras, look_at_host
from tactbench.core.plugins.registry import Owned, Registry
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, Source, StreamSpec
from tactbench.plugin.devices import Driver
from tests.core.cli.terminals import ROOT
from tests.links.ends import pty

WIRED = ROOT / "tests" / "third_party" / "wired"
AS_NOBODY = """
import grp, os, sys
sys.path.insert(0, sys.argv[1])
from tactbench.core.cli.host_devices import serial_ports
list(serial_ports())  # imports what it needs while that can be read
os.setgroups([]), os.setgid(65534), os.setuid(65534)
for port in serial_ports():
    print(port.name, port.state, port.hint)
"""
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


def doctor(folder, *arguments, code=0):
    """Return what the verb says in a process of its own."""
    env = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{WIRED}", "COLUMNS": "200", "PYTHONWARNINGS": "error"}
    done = subprocess.run(
        [sys.executable, "-m", "tactbench", "doctor", *arguments], cwd=folder, env=env, capture_output=True, text=True,
        timeout=100, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == code, f"exit {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done


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


def test_this_machine(tmp_path):
    about = json.loads(doctor(tmp_path, "--format", "json", code=host_code()).stdout)
    named = {(one["kind"], one["name"]): one for one in about["host"]}
    ports = sorted(port.device for port in comports())
    assert [name for kind, name in named if kind == "serial port"] == ports
    assert "sleeps of 5 ms end" in named["clock", "clock"]["text"]
    offered = {"dask", "fast", "multicast", "parquet", "spi", "wavelets", "xlsx"}
    assert {name for kind, name in named if kind == "extra"} == offered
    assert {"name": "wired-pad", "kind": "sensor", "driver": "wired_tactile.driver:build", "emulator": ""} in about[
        "drivers"
    ]
    assert about["devices"] == []


def host_code():
    """What this machine's own ports make of the exit code."""
    return 1 if any(one.state == "denied" for one in look_at_host()) else 0


def test_what_does_not_work_comes_first_and_what_works_in_one_line(doctor_here):
    *before, last = doctor_here(code=host_code()).stdout.splitlines()
    assert last.startswith("Works: ")
    assert "wired-scale" in last
    assert all(line.startswith(("Wrong: ", "Missing: ")) for line in before)


def test_a_missing_extra_comes_with_its_command():
    for extra in extras():
        if extra.state == "missing":
            assert extra.hint == f"pip install 'tactbench[{extra.name}]'"
            for name in extra.text.removeprefix("not installed: ").split(", "):
                with pytest.raises(metadata.PackageNotFoundError):
                    metadata.version(name)


@pytest.mark.skipif(sys.platform != "linux" or os.getuid() != 0, reason="needs root, to be somebody else")
def test_a_port_that_this_user_may_not_open_says_how_to():
    closed = [port.device for port in comports() if not Path(port.device).stat().st_mode & 0o006]
    if not closed:
        pytest.skip("anybody may open every serial port of this machine")
    done = subprocess.run(
        [sys.executable, "-c", AS_NOBODY, ROOT], capture_output=True, text=True, check=True, timeout=60
    )
    for path in closed:
        assert f"{path} denied " in done.stdout
        assert "sudo usermod -aG" in done.stdout or "udev rule" in done.stdout


def test_a_rig_on_lines_is_opened_asked_and_read(tmp_path, doctor_here):
    pad = b"".join(b"%d %d 500\n" % (n, 100 + n % 2) for n in range(50)) + b"nonsense here\n60 100 500\n"
    scale = b"".join(b"%d %.2f\n" % (n, 0.25 + 0.01 * (-1) ** n) for n in range(40))
    with talking(pad) as one, talking(scale) as other:
        (tmp_path / "rig.yaml").write_text(RIG.format(pad=one.name, scale=other.name))
        done = doctor(tmp_path, "--rig-file", "rig.yaml", "--seconds", "0.5", "--format", "json", code=1)
        shown = doctor_here("--rig-file", "rig.yaml", "--seconds", "0.5", code=1).stdout
    about = json.loads(done.stdout)
    sensor, force, motor = about["devices"]
    assert "nothing may touch them" in done.stderr
    assert sensor["identity"] == force["identity"] == {"model": "pad-3000", "serial": "0815"}
    (taxels,) = sensor["streams"]
    assert (taxels["rows"], taxels["lost"]) == (51, 10)
    assert taxels["noise"][0]["constant"] == ["t2"]
    assert taxels["noise"][0]["means"]["t2"] == 500
    assert sensor["counts"] == {"lines that are no samples": 1}
    (fz,) = force["streams"][0]["noise"]
    assert (fz["kind"], fz["unit"]) == ("force", "N")
    assert fz["means"]["fz"] == pytest.approx(0.25)
    assert fz["sd_median"] == pytest.approx(0.01 * np.sqrt(40 / 39))
    assert motor["emulated"]
    assert "wired-motor has no emulator" in motor["problems"][0]
    (problem,) = [text for text in about["problems"] if text.startswith("wired-pad")]
    assert "of 51 rows: 10 lost" in problem
    for text in ("model pad-3000", "fz +0.25", "0.0101 N", "10 lost"):
        assert text in shown


def test_one_device_that_fails_ends_no_other(tmp_path, doctor_here):
    with talking(b"1 100 500\n2 100 500\n") as line:
        (tmp_path / "rig.yaml").write_text(RIG.format(pad="/dev/is-not-there", scale=line.name))
        about = json.loads(doctor_here("--rig-file", "rig.yaml", "--seconds", "0.3", "--format", "json", code=1).stdout)
    sensor, force, _ = about["devices"]
    assert "cannot be opened" in sensor["problems"][0]
    assert "Check the name and the cable" in sensor["problems"][0]
    assert force["identity"]["model"] == "pad-3000"
    assert force["streams"][0]["rows"] == 2


def test_a_wrong_rig_file_is_a_usage_error(tmp_path, doctor_here):
    (tmp_path / "rig.yaml").write_text("rig: bench\nsensors: {no-such: {link: emulated}}\n")
    assert "no-such" in doctor_here("--rig-file", "rig.yaml", code=2).stderr
    (tmp_path / "rig.yaml").write_text("rig: bench\nsensor: {}\n")
    assert "rig.yaml:2" in doctor_here("--rig-file", "rig.yaml", code=2).stderr


PAD = StreamSpec(
    name="taxels", rate_hz=100, channels=tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(3))
)
log: list[str] = []


class Paced(Driver):
    """A pad in virtual time: its clock is its own."""

    streams = (PAD,)
    counts: ClassVar = {}

    def __init__(self, settings):
        self.options, self.clock, self.sent = settings.options, settings.clock, 0
        self.rng = np.random.default_rng(1)

    def identify(self):
        log.append("identify")
        if self.options.get("raises"):
            raise ValueError("of somebody else")
        return {"model": "paced"}

    def start(self):
        log.append("start")

    def read(self, timeout_s):
        self.clock.now_ns += round(timeout_s * 1e9)
        due = int(self.clock.now_ns * 1e-9 * self.options.get("rate_hz", 100))
        if self.options.get("mute") or due == self.sent:
            return []
        rows = np.arange(self.sent, due)
        self.sent = due
        data = 1000 + self.rng.normal(size=(len(rows), 3)) * [1, 2, 0]
        quality = np.zeros(data.shape, np.uint8)
        if 25 in rows and self.options.get("bad"):
            quality[list(rows).index(25)] = Quality.MISSING
            data[list(rows).index(25)] = 1e9
        times = np.round(rows / self.options.get("rate_hz", 100) * 1e9).astype(np.int64)
        if self.options.get("twice") and 25 in rows:
            again = np.insert(np.arange(len(rows)), list(rows).index(25), list(rows).index(25))
            rows, times, data, quality = rows[again], times[again], data[again], quality[again]
        return [Block("taxels", times, data, quality, sequence=rows)]

    def stop(self):
        log.append("stop")

    def close(self):
        log.append("close")


class VirtualClock:
    now_ns = 0

    def __call__(self):
        return self.now_ns


def checked(**options):
    """Return the check of a pad with these options, and what was done to it."""
    log.clear()
    where = f"{__name__}:Paced"
    source = Source(tag="assumed", reference="test")
    spec = SensorSpec(name="pad", title="p", principle="p", principle_source=source, streams=(PAD,))
    registry = Registry()
    registry.sensors.add(Owned(SensorDescriptor(spec=spec, driver=where), "m", "d", "1"))
    registry.devices.add(Owned(DeviceDescriptor(name="axis", title="a", kind="motor", driver=where), "m", "d", "1"))
    rig = RigFile.model_validate(
        {
            "rig": "bench",
            "sensors": {"pad": {"link": "loop://", "options": options}},
            "devices": {"motor": {"device": "axis", "link": "loop://"}},
        }
    )
    return check_devices(rig, registry, seconds=3, clock=VirtualClock())


def test_noise_and_rate_in_virtual_time():
    pad, motor = checked()
    (stream,) = pad.streams
    assert stream.rows == 300
    assert stream.rate_hz == pytest.approx(100)
    (noise,) = stream.noise
    assert noise.sd_median == pytest.approx(1, rel=0.15), "300 values: a standard error of 4 %"
    assert noise.sd_largest == pytest.approx(2, rel=0.15)
    assert (noise.noisiest, noise.constant) == ("t1", ("t2",))
    assert pad.problems == []
    assert log == ["identify", "start", "stop", "close", "identify", "close"], "a motor is not started"
    assert motor.remarks == ["a motor: not started"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"rate_hz": 90}, "came at 90 Hz, stated are 100 Hz"),
        ({"rate_hz": 99}, ""),
        ({"bad": True}, "of 300 rows: 1 MISSING"),
        ({"mute": True}, "Nothing came of its stream taxels within 3 s"),
        ({"twice": True}, "of 300 rows: 1 twice or late"),
    ],
)
def test_what_a_stream_lacks_is_told(options, says):
    pad, _ = checked(**options)
    assert says in "".join(pad.problems)
    assert bool(says) == bool(pad.problems)
    for stream in pad.streams:
        assert stream.noise[0].sd_largest < 3, "samples that are missing are in no noise"
    assert log[:4] == ["identify", "start", "stop", "close"]


def test_a_driver_of_others_that_raises_anything_is_closed_and_told():
    pad, motor = checked(raises=True)
    assert "raised ValueError: of somebody else" in pad.problems[0]
    assert log[:2] == ["identify", "close"]
    assert motor.identity == {"model": "paced"}


EMULATED = """
rig: bench
sensors:
  icub: {{link: emulated{icub}}}
  biotac: {{link: emulated}}
force: {{device: net-ft, link: emulated{force}}}
devices: {{motor: {{device: faulhaber, link: emulated}}}}
"""


def of_emulated(verbs, *arguments, code, icub="", force=""):
    (verbs.folder / "rig.yaml").write_text(EMULATED.format(icub=icub, force=force))
    done = verbs("doctor", "--rig-file", "rig.yaml", "--format", "json", *arguments, code=code)
    return json.loads(done.stdout)


def test_emulated_devices_at_rest_are_read_and_said_to_be_emulated(verbs):
    icub, biotac, force, motor = of_emulated(verbs, "--seconds", "1", code=0)["devices"]
    rates = {stream["stream"]: stream["rate_hz"] for one in (icub, biotac, force) for stream in one["streams"]}
    assert rates == pytest.approx({"taxels": 50, "electrodes": 100, "vibration": 2200, "force_torque": 1000}, rel=0.01)
    assert all("emulated" in one["remarks"] for one in (icub, biotac, force, motor))
    (clock,) = [stream["clock"] for stream in force["streams"]]
    assert abs(clock["drift_ppm"]) <= 1, "in virtual time both clocks are one"
    assert clock["bound_us"] is not None
    assert icub["streams"][0]["clock"] is None, "its board sends no time"
    assert "a motor: not started" in motor["remarks"]
    assert motor["identity"] != {}
    assert motor["streams"] == []


def test_faults_of_emulated_devices_are_found(verbs):
    about = of_emulated(
        verbs, code=1,
        icub=', faults: ["not-connected:start_s=2"]', force=', faults: ["unplug:start_s=1"]',
    )  # fmt: skip
    icub, _, force, _ = about["devices"]
    assert any("MISSING" in text for text in icub["problems"])
    assert any("is gone" in text for text in force["problems"])
