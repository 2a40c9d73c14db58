"""`tactbench emulate` in this process: what it prints is what opens the devices."""

from __future__ import annotations

import io
import threading
from importlib.metadata import EntryPoint

import pytest

from tactbench.core.cli import main
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.yaml_file import load_yaml
from tactbench.plugin.devices import EmulatedDevices, RigFile, drivers_of
from tests.core.plugins import talking

POINTS = [
    EntryPoint("talking", talking.HERE, "tactbench"),
    EntryPoint("twin", "tactbench.rigs.twin", "tactbench"),
    EntryPoint("bench", "tactbench.rigs.bench", "tactbench"),
]


@pytest.fixture
def emulate(monkeypatch, tmp_path, capsys):
    """The verb with these plugins, in a folder of its own: its exit code, stdout and stderr."""
    monkeypatch.setattr("tactbench.core.plugins.registry.entry_points", lambda group: POINTS)
    monkeypatch.chdir(tmp_path)

    def call(*words, out=None, presses=2):
        real, left = EmulatedDevices.advance, iter(range(presses - 1))

        def advance(self, until_ns):
            real(self, until_ns)
            if next(left, None) is None:
                raise KeyboardInterrupt

        monkeypatch.setattr(EmulatedDevices, "advance", advance)
        out = out or io.StringIO()
        monkeypatch.setattr("sys.stdout", out)
        with pytest.raises(SystemExit) as ended:
            main(["emulate", *words])
        return ended.value.code, out.getvalue(), capsys.readouterr().err

    return call


SHORT = ("--profile", "ramp:duration=0.5")


def test_the_rig_file_printed_opens_the_devices(emulate, tmp_path):
    """While it runs, drivers of that file read the pad and the scale from another thread."""
    read, not_yet, printed = {}, threading.Event(), io.StringIO()

    def record():
        registry = load_registry(POINTS)
        while not printed.getvalue():
            not_yet.wait(0.02)
        (tmp_path / "rig.yaml").write_text(printed.getvalue())
        drivers = drivers_of(load_yaml(tmp_path / "rig.yaml", RigFile), registry, "pad", {}, lambda: 0)
        for name, driver in drivers.items():
            with driver:
                driver.start()
                read[name] = [driver.read(5.0)[0].data for _ in range(40)]

    thread = threading.Thread(target=record)
    thread.start()
    code, _, err = emulate("pad", "scale", "screw", *SHORT, out=printed)
    thread.join()
    assert code == 130
    file = load_yaml(tmp_path / "rig.yaml", RigFile)
    assert (file.rig, list(file.entries())) == ("bench", ["pad", "force", "motor"])
    assert all(entry.link.startswith("udp://127.0.0.1:") for entry in file.entries().values())
    assert file.force.options == {"unit": "N"}  # as of a real one, from now on
    assert "tactbench record --rig-file rig.yaml --sensor pad --live --out press.h5" in err
    assert "Press 1: 5 N after 0.5 s" in err
    assert "Press 2:" in err
    assert max(abs(data).max() for data in read["pad"]) > 100  # 1000 counts a newton
    assert all(data.shape == (1, 1) for data in read["force"])


def test_a_force_sensor_alone_feels_the_force_alone_and_ctrl_c_leaves_no_thread(emulate):
    before = threading.active_count()
    code, out, err = emulate("scale", "--profile", "ramp:duration=0.1", presses=1)
    assert code == 130
    assert threading.active_count() == before
    assert out.startswith("force: udp://127.0.0.1:")
    assert "A rig file needs a sensor" in err


def test_a_rig_file_is_started_and_keeps_what_is_real(emulate, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "rig: bench\ntitle: here\nsensors: {pad: {link: emulated, faults: [late, 'unplug:start_s=0.2']}}\n"
        "force: {device: scale, link: 'udp://127.0.0.1:9', channel: fx, sign: -1}\nsettings: {colour: red}\n"
    )
    code, out, err = emulate("--rig-file", "mine.yaml", *SHORT)
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
        ((), "Either devices or a rig file"),
        (("pda",), "Did you mean 'pad'"),
        (("bare-scale",), "bare-scale has no emulator"),
        (("--rig-file", "late.yaml"), "'delay_s'"),
        (("--rig-file", "parity.yaml"), "no fault 'parity'"),
        (("--rig-file", "twni.yaml"), "Did you mean 'twin'"),
    ],
)
def test_what_cannot_be_is_said_with_the_next_step(emulate, tmp_path, words, said):
    wrong = {"late": ", faults: ['late:delay=1']}}", "parity": ", faults: [parity]}}",
             "twni": "}}\nemulation: {physics: twni}"}  # fmt: skip
    for name, more in wrong.items():
        (tmp_path / f"{name}.yaml").write_text(f"rig: bench\nsensors: {{pad: {{link: emulated{more}\n")
    code, out, err = emulate(*words)
    assert (code, out) == (2, "")
    assert said in err
