"""The kit against plugins with one flaw each: each is caught by the check that is meant for it, and by no other."""

from __future__ import annotations

import runpy
from importlib.metadata import EntryPoint, distribution, entry_points

import pytest

from tactbench.core.conformance.check import KINDS
from tactbench.core.conformance.kit import CHECKS, FLOORS, checks_of
from tactbench.core.conformance.run import run_checks, subjects_named
from tactbench.core.plugins.registry import load_registry
from tests.conftest import THIRD_PARTY

SHELF = THIRD_PARTY / "flawed"
PACKAGE = runpy.run_path(str(SHELF / "flawed_tactile" / "__init__.py"))
CAUGHT_BY = PACKAGE["CAUGHT_BY"]
ROWS = [(kind, name, meant) for kind, flaws in CAUGHT_BY.items() for name, meant in flaws.items()]
NOT_SHELVED = ("recording",)
"""Modes whose checks look at files: test_recorded.py."""


@pytest.fixture(scope="module")
def registry():
    """Everything installed and the shelf, found by their entry points."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(SHELF)
        yield load_registry()


@pytest.mark.parametrize(("kind", "name", "meant"), ROWS, ids=[name for _, name, _ in ROWS])
def test_each_is_caught_by_the_check_that_is_meant_for_it(registry, tmp_path, kind, name, meant):
    (subject,) = subjects_named(registry, name, (kind,))
    rig_file = written_for(tmp_path, kind, name)
    report = run_checks(subject, modes=modes_with(rig_file), rig_file=rig_file, isolated=False)
    assert [one.check for one in report.failed] == ([] if meant is None else [meant])
    assert all(one.where and one.text for one in report.failed)


def written_for(folder, kind, name):
    """Write the rig file of a plugin of the shelf and return its path; None: it needs none."""
    text = PACKAGE["rig_file"](kind, name)
    if text is None:
        return None
    path = folder / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def modes_with(rig_file):
    return ("passive",) if rig_file is None else ("passive", "invasive")


def test_every_check_has_caught_one():
    proved = {(kind, meant) for kind, _, meant in ROWS}
    shared = {meant for _, _, meant in ROWS}
    for check in CHECKS:
        if check.mode not in NOT_SHELVED:
            assert check.name in shared, f"no plugin of the shelf fails {check.name}"
    assert {("estimator", "enough-checks-ran"), ("sensor", "tiny-press-is-carried-out")} & proved


def test_there_are_forty_checks_and_twenty_flaws():
    assert len(CHECKS) >= 40
    assert sum(meant is not None for _, _, meant in ROWS) >= 20


@pytest.mark.parametrize("kind", KINDS)
def test_the_floor_is_what_every_plugin_can_run(kind):
    never_skipped = [one for one in checks_of(kind, "passive") if not one.may_skip]
    assert FLOORS[kind] >= len(never_skipped) > 0


def test_checks_say_why_they_exist_and_what_to_do():
    for check in CHECKS:
        assert check.why.endswith("."), check.name
        assert check.cure.endswith("."), check.name
        known = {one.name for kind in check.kinds for one in checks_of(kind, check.mode, "passive")}
        assert set(check.needs) <= known, check.name


@pytest.mark.usefixtures("registry")
def test_it_is_the_shelf_that_was_found():
    assert distribution("flawed-tactile").version == "0.9.0"
    assert EntryPoint("flawed-heavy", "flawed_tactile.heavy", "tactbench") in entry_points(group="tactbench")
