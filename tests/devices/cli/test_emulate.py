"""`tactbench emulate` in this process: what it prints is what opens the devices."""

from __future__ import annotations

import io
import threading
from importlib.metadata import EntryPoint

import pytest

from tactbench.core.cli import main
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.yaml_file import load_yaml
from tactbench.devices.emulation.real_time import RealTimeDevices
from tactbench.plugin import ForceRamp, Scene
from tactbench.plugin.devices import RigFile, drivers_of, physics_of
from tests.devices import talking

POINTS = [
    EntryPoint("talking", talking.HERE, "tactbench"),
    EntryPoint("twin", "tactbench.rigs.twin", "tactbench"),
    EntryPoint("bench", "tactbench.rigs.bench", "tactbench"),
]


SCENE = Scene(
    name="press", profile=ForceRamp(duration=assumed(0.5, "s", "short"), hold=assumed(0.1, "s", "short"), samples=50)
)


@pytest.fixture
def emulate(monkeypatch, tmp_path, capsys):
    """The verb with these plugins, in a folder of its own, until `over` is set: its exit code, stdout and stderr."""
    monkeypatch.setattr("tactbench.core.plugins.registry.entry_points", lambda group: POINTS)
    monkeypatch.chdir(tmp_path)

    def call(*words, out=None, over=None):
        def check(self):
            if over is None or over.is_set():
                raise KeyboardInterrupt

        monkeypatch.setattr(RealTimeDevices, "check", check)
        out = out or io.StringIO()
        monkeypatch.setattr("sys.stdout", out)
        with pytest.raises(SystemExit) as ended:
            main(["emulate", *words])
        return ended.value.code, out.getvalue(), capsys.readouterr().err

    return call


def test_the_rig_file_printed_opens_devices_that_are_pressed_when_the_recording_begins(emulate, tmp_path):
    """They were pressed when they liked, and a recording of the second terminal had an arbitrary part of a press."""
    rest, pressed, over, not_yet, printed = [], [], threading.Event(), threading.Event(), io.StringIO()

    def record():
        registry = load_registry(POINTS)
        while not printed.getvalue():
            not_yet.wait(0.02)
        (tmp_path / "rig.yaml").write_text(printed.getvalue())
        file = load_yaml(tmp_path / "rig.yaml", RigFile)
        physics = physics_of(file, registry)
        try:
            with (
                drivers_of(file, registry, "pad", {}, lambda: 0, ["pad"])["pad"] as pad,
                physics.open(registry.sensors["pad"], SCENE, seed=1) as said,
            ):
                pad.start()
                while pad.read(0.0):
                    pass
                rest.extend(pad.read(5.0)[0].data for _ in range(20))
                physics.begin()
                while pad.read(0.0):
                    pass
                pressed.extend(pad.read(5.0)[0].data for _ in range(60))
            assert said.plan
        finally:
            over.set()

    thread = threading.Thread(target=record)
    thread.start()
    code, _, err = emulate("pad", "scale", "screw", out=printed, over=over)
    thread.join()
    assert code == 130
    file = load_yaml(tmp_path / "rig.yaml", RigFile)
    assert (file.rig, list(file.entries())) == ("bench", ["pad", "force"])
    assert all(entry.link.startswith("udp://127.0.0.1:") and entry.emulator for entry in file.entries().values())
    assert file.force.options == {"unit": "N"}  # as of a real one, from now on
    assert "motor" in err
    # 1000 counts a newton; the ramp rises for 0.4 s.
    assert max(abs(data).max() for data in rest) < 100 < max(abs(data).max() for data in pressed)


def test_a_rig_file_is_started_and_keeps_what_is_real(emulate, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "rig: bench\ntitle: here\nsensors: {pad: {link: emulated, faults: [late, 'unplug:start_s=0.2']}}\n"
        "force: {device: scale, link: 'udp://127.0.0.1:9', channel: fx, sign: -1}\nsettings: {colour: red}\n"
    )
    code, out, err = emulate("--rig-file", "mine.yaml")
    assert code == 130
    (tmp_path / "out.yaml").write_text(out)
    file = load_yaml(tmp_path / "out.yaml", RigFile)
    assert file.sensors["pad"].link.startswith("udp://127.0.0.1:")
    assert file.sensors["pad"].faults == ()
    assert (file.force.link, file.force.channel, file.force.sign) == ("udp://127.0.0.1:9", "fx", -1)
    assert (file.title, file.settings) == ("here", {"colour": "red"})
    assert "pad" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "rig file"),
        (("pad", "scale", "bare-scale"), "one force"),
        (("pad", "bare-scale"), "bare-scale"),
    ],
)
def test_what_cannot_be_is_said_with_the_next_step(emulate, words, said):
    code, out, err = emulate(*words)
    assert (code, out) == (2, "")
    assert said in err
