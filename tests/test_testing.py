"""The door to tests: checks for pytest, and reports."""

from __future__ import annotations

import pytest

from tactbench import testing
from tactbench.core.conformance.check import CheckOutcome
from tactbench.core.conformance.run import checks_of
from tactbench.core.errors import UnknownNameError
from tactbench.testing import CheckFailed, CheckReport, PluginCheck

ASKED = testing.plugin_checks("ols")


def test_all_checks_of_a_kind_are_handed_to_pytest_by_name():
    assert [str(one) for one in ASKED] == [f"estimator-{one.name}" for one in checks_of("estimator")]
    ASKED[0]()


def test_a_report_raises_nothing_and_a_wrong_name_does():
    (report,) = testing.check_plugin("force")
    assert report.ok
    assert report.level == "silver"
    with pytest.raises(UnknownNameError):
        testing.plugin_checks("nobody")


@pytest.mark.parametrize(
    ("status", "raised"),
    [
        ("passed", None),
        ("failed", CheckFailed),
        ("skipped", pytest.skip.Exception),
    ],
)
def test_what_came_of_a_check_is_pytests(status, raised):
    outcome = CheckOutcome("it-learns", status, "predict", "it does not")
    check = PluginCheck("estimator-it-learns", lambda: CheckReport("estimator", "x", (outcome,)))
    if raised is None:
        check()
        return
    with pytest.raises(raised, match="it does not"):
        check()
