"""The verb: what it says, and how it ends; and plugins that hang, crash or would be let off."""

from __future__ import annotations

import json

from tactbench.core.conformance.run import run_checks, subjects_named
from tactbench.core.plugins.registry import load_registry
from tests.conftest import THIRD_PARTY
from tests.core.conformance.test_recorded import written


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
    assert [one["check"] for one in report["checks"] if one["status"] == "failed"] == ["recording-fits-the-spec"]


def test_checks_are_listed_without_a_name(verbs):
    listed = json.loads(verbs("check", "--list", "--format", "json").stdout)
    assert {"driver-reads", "it-learns"} <= {one["check"] for one in listed}
    assert all(one["why"].endswith(".") and one["do"].endswith(".") for one in listed)
    assert "NAME" in verbs("check", code=2).stderr
    assert "sensors" in verbs("check", "force", "--recording", __file__, code=2).stderr
