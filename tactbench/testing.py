"""Access to the checks of ``tactbench check`` from a plugin's own tests with pytest.

The plugin must be installed (``pip install -e .``), because it is found by its entry point.
``tactbench check --list`` lists the checks.

>>> import pytest
>>> from tactbench.testing import plugin_checks
>>> @pytest.mark.parametrize("check", plugin_checks("ideal"), ids=str)
... def test_conforms(check):
...     check()
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from tactbench.core.conformance.check import CheckFailed, CheckOutcome, Subject
from tactbench.core.conformance.run import CheckReport, checks_of, run_checks, subjects_named
from tactbench.core.plugins.registry import installed

__all__ = ["CheckFailed", "CheckReport", "PluginCheck", "check_plugin", "plugin_checks"]


@dataclass(frozen=True)
class PluginCheck:
    """One check of one plugin, callable in a test; its text form is the check's name.

    The checks of a sensor, task … are all run in one child process when the first check is called.
    """

    name: str
    """Name of the check, ``kind-check``."""
    report: Callable[[], CheckReport]

    def __str__(self) -> str:
        return self.name

    def __call__(self) -> None:
        """Raise CheckFailed if the plugin fails this check; skip the test if the check does not apply to the plugin."""
        import pytest

        check = self.name.partition("-")[2]
        found = {one.check: one for one in self.report().outcomes}
        outcome = found.get(check, CheckOutcome(check, "failed", "checks", "it has not run"))
        if outcome.status == "skipped":
            pytest.skip(outcome.text)
        if outcome.status == "failed":
            raise CheckFailed(outcome.where, "\n".join(filter(None, (outcome.text, outcome.advice))))


@cache
def _report(subject: Subject, recording: Path | None) -> CheckReport:
    return run_checks(subject, recording=recording)


def plugin_checks(name: str, *, recording: Path | None = None) -> list[PluginCheck]:
    """Return the checks of `name` for ``pytest.mark.parametrize``; raise UnknownNameError for an unknown name.

    Parameters
    ----------
    name
        Name of a sensor, rig, device, task, estimator, effect, indenter or profile, or of a plugin that has several.
    recording
        A recording of the sensor, which is then checked too.
    """
    return [
        PluginCheck(f"{subject.kind}-{one.name}", partial(_report, subject, recording))
        for subject in subjects_named(installed(), name)
        for one in checks_of(subject.kind)
    ]


def check_plugin(name: str, *, recording: Path | None = None) -> list[CheckReport]:
    """Run the checks of `name` and return their outcomes; raise UnknownNameError for an unknown name."""
    return [_report(subject, recording) for subject in subjects_named(installed(), name)]
