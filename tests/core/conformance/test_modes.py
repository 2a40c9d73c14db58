"""The verb: what it opens, what it says, and how it ends; and plugins that hang, crash or would be let off."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from tactbench.core.conformance.run import run_checks, subjects_named
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.rig_file import DeviceEntry
from tactbench.devices.emulation.emulated_devices import EmulatedDevices
from tactbench.devices.rig_devices import emulated_device
from tests.conftest import THIRD_PARTY
from tests.core.conformance.test_recorded import written
from tests.rigs.parallel_manipulator.spring import EXAMPLE, example

pytestmark = pytest.mark.timeout(600)  # presses take minutes where each line is traced
QUICK = {
    "sensors__biotac": ...,
    "force__options__rate_hz": 125.0,
    "settings__force_loop__rate_hz": 50.0,
    "settings__touch__settle_s": 0.3,
    "settings__heights__stand_off_mm": 1.0,
}
"""Less to compute than in the example's own press."""


def test_a_sound_plugin_ends_with_0_and_says_how_many_checks_ran(verbs):
    *_, last = verbs("check", "acme-pad", plugins=("good",)).stdout.splitlines()
    assert {"sensor", "acme-pad:", "silver."} <= set(last.split())


def test_by_the_name_of_its_plugin_all_that_it_brings_is_checked(monkeypatch):
    monkeypatch.syspath_prepend(THIRD_PARTY / "wired")
    assert {(one.kind, one.name) for one in subjects_named(load_registry(), "wired-tactile")} == {
        ("rig", "wired-rig"), ("sensor", "wired-pad"), ("device", "wired-scale"), ("device", "wired-motor"),
    }  # fmt: skip


def test_one_that_cannot_be_loaded_is_named_with_its_line(verbs):
    for name in ("broken-tactile", "broken-pad"):  # the plugin, and what it would have brought
        assert "broken_tactile/__init__.py" in verbs("check", name, plugins=("broken",), code=1).stdout


def test_a_name_that_nothing_has_is_a_wrong_command(verbs):
    assert "'ideal'" in verbs("check", "ideel", code=2).stderr


def test_one_that_crashes_fails_its_check_and_ends_nothing(monkeypatch):
    monkeypatch.syspath_prepend(THIRD_PARTY / "evil")
    (subject,) = subjects_named(load_registry(), "evil-abort")
    report = run_checks(subject)
    (failed,) = report.failed
    assert failed.check == "answers-have-the-shape"
    assert "SIGABRT" in failed.text
    assert {one.check for one in report.of("skipped")} == {"seed-and-data-decide", "it-learns"}


def test_a_recording_is_checked_beside_the_plugin(verbs, tmp_path):
    path = written(tmp_path / "press.h5", "in grams")
    done = verbs("check", "icub", "--recording", str(path), "--format", "json", code=1)
    (report,) = json.loads(done.stdout)["checked"]
    assert report["modes"] == ["passive", "recording"]
    assert [one["check"] for one in report["checks"] if one["status"] == "failed"] == ["recording-fits-the-spec"]


def test_nothing_is_opened_without_a_yes(verbs):
    asked = verbs("check", "parallel-manipulator", "--rig-file", str(EXAMPLE), code=2)
    assert "--yes" in asked.stderr
    assert asked.stdout == ""


def of_the_press(done):
    """Return status and text of the checks that press."""
    (report,) = json.loads(done.stdout)["checked"]
    return {one["check"]: (one["status"], one["text"]) for one in report["checks"] if "real-rig" in one["check"]}


def quick(tmp_path, **changes):
    """Write a rig file of an emulated press without a manipulator."""
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(example(**QUICK, **changes)), encoding="utf-8")
    return str(path)


def test_an_emulated_rig_presses_lets_go_and_retreats(verbs, tmp_path):
    done = verbs("check", "parallel-manipulator", "--rig-file", quick(tmp_path), "--yes",
                 "--format", "json")  # fmt: skip
    assert of_the_press(done) == {"real-rig-presses": ("passed", "")}
    assert json.loads(done.stdout)["checked"][0]["level"] == "silver"


def test_a_press_that_the_guard_ends_fails_and_is_not_repeated(verbs, tmp_path):
    file = quick(tmp_path, force__faults=["saturated:start_s=3"])
    done = verbs("check", "parallel-manipulator", "--rig-file", file, "--yes", "--format", "json", code=1)
    status, text = of_the_press(done)["real-rig-presses"]
    assert status == "failed"
    assert "saturated" in text


def test_a_hand_at_the_bench_is_not_expected_to_follow(verbs, tmp_path):
    said = yaml.safe_load(EXAMPLE.with_name("bench-emulated.yaml").read_text(encoding="utf-8"))
    said["sensors"].pop("biotac")
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(said), encoding="utf-8")
    done = verbs("check", "bench", "--rig-file", "rig.yaml", "--yes", "--format", "json")
    assert of_the_press(done) == {"real-rig-presses": ("passed", "")}


def test_ctrl_c_stops_what_moves(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(THIRD_PARTY / "flawed")
    (subject,) = subjects_named(load_registry(), "sound-press")
    from sound_rigs import code

    monkeypatch.setattr(code.Press, "signal_at", 400)
    file = tmp_path / "rig.yaml"
    file.write_text("version: 1\nrig: sound-press\nsensors:\n  sound-pad: {link: 'loop://'}\n", encoding="utf-8")
    code.STOPPED.clear()
    with pytest.raises(KeyboardInterrupt):
        run_checks(subject, modes=("invasive",), rig_file=file)
    assert len(code.STOPPED) == 1


@pytest.mark.parametrize(("noise", "status", "says"), [(1.0, "passed", ""), (0.0, "failed", "constant")])
def test_with_a_yes_a_real_line_is_opened_and_its_noise_compared(tmp_path, monkeypatch, noise, status, says):
    monkeypatch.syspath_prepend(THIRD_PARTY / "flawed")
    (subject,) = subjects_named(load_registry(), "sound-pad")
    names, rng = [one.name for one in subject.spec.channels()], np.random.default_rng(0)

    def senses(t_s):
        return dict(zip(names, 100 + noise * rng.normal(size=len(names)), strict=True))

    device = emulated_device(subject.descriptor, "sound-pad", DeviceEntry(link="emulated"), senses, 1)
    file = tmp_path / "rig.yaml"
    with EmulatedDevices({"sound-pad": device}, time="real") as devices:
        link = devices.addresses["sound-pad"]
        file.write_text(f"version: 1\nrig: bench\nsensors:\n  sound-pad: {{link: {json.dumps(link)}}}\n")
        report = run_checks(subject, modes=("invasive",), rig_file=file, isolated=False)
    assert [(one.check, one.status) for one in report.outcomes] == [("real-device-answers", status)], str(report)
    assert says in report.outcomes[0].text


def test_checks_are_listed_without_a_name(verbs):
    listed = json.loads(verbs("check", "--list", "--format", "json").stdout)
    assert {"driver-reads", "it-learns"} <= {one["check"] for one in listed}
    assert all(one["why"].endswith(".") and one["do"].endswith(".") for one in listed)
    assert "NAME" in verbs("check", code=2).stderr
