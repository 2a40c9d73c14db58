"""The door to tests: checks for pytest, reports, and strategies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from tactbench import testing
from tactbench.core.conformance.kit import checks_of
from tactbench.core.errors import UnknownNameError
from tactbench.core.plugins.registry import installed
from tactbench.sensors.ideal import SPEC
from tactbench.sensors.ideal.transduction import build
from tactbench.testing import CheckFailed, CheckReport, PluginCheck, strategies

ASKED = testing.estimator_checks("ols")


@pytest.mark.parametrize("check", ASKED, ids=str)
def test_checks_are_handed_to_pytest_by_name(check):
    check()


def test_all_checks_of_a_kind_are_handed_out_and_two_about_the_run():
    names = [str(one) for one in ASKED]
    assert names[:-2] == [one.name for one in checks_of("estimator", "passive")]
    assert names[-2:] == ["expected-failures-are-checks", "enough-checks-ran"]


def test_a_report_raises_nothing_and_a_wrong_name_does():
    report = testing.check_task("force")
    assert report.ok
    assert report.level == "silver"
    with pytest.raises(UnknownNameError):
        testing.check_sensor("nobody")


@pytest.mark.parametrize(
    ("status", "raised"),
    [
        ("passed", None),
        ("failed", CheckFailed),
        ("skipped", pytest.skip.Exception),
        ("expected", pytest.xfail.Exception),
    ],
)
def test_what_came_of_a_check_is_pytests(status, raised):
    outcome = testing.CheckOutcome("it-learns", status, "predict", "it does not")
    check = PluginCheck("it-learns", "Why.", "Do.", lambda: CheckReport("estimator", "x", ("passive",), (outcome,)))
    if raised is None:
        check()
        return
    with pytest.raises(raised, match="it does not"):
        check()


@given(state=strategies.skin_states(SPEC))
@settings(max_examples=20)
def test_states_of_a_skin_can_be_read_by_its_transducer(state):
    names = [channel.name for channel in SPEC.channels()]
    readings = build(SPEC, state.grid, names)(state)
    assert readings.shape == (16,)
    assert np.isfinite(readings).all()
    assert state.force_n * 1000 + 1e-6 >= readings.max() >= 0  # 1000 counts a newton, all of it over one taxel


@given(scene=strategies.scenes(), question=strategies.questions("classification"))
@settings(max_examples=10)
def test_scenes_and_questions_are_possible_ones(scene, question):
    X, y = question
    assert 0 < scene.profile.end.to("N") <= 2
    assert len(X) == len(y)
    assert set(y) == {0, 1, 2}
    assert installed().sensors["ideal"].spec.skin is not None
