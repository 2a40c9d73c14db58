"""What a plugin's author tests with: the checks of ``tactbench check`` for pytest, and strategies for hypothesis.

The plugin must be installed (``pip install -e .``): it is found by its entry point, as a user finds it.
``docs/conformance.md`` lists the checks and shows a test of each kind.

>>> import pytest
>>> from tactbench.testing import sensor_checks
>>> @pytest.mark.parametrize("check", sensor_checks("ideal"), ids=str)
... def test_conforms(check):
...     check()
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from tactbench.core.conformance.check import CheckFailed, CheckOutcome, Kind, Mode
from tactbench.core.conformance.kit import OF_THE_LIST, checks_of
from tactbench.core.conformance.run import CheckReport, run_checks, subjects_named
from tactbench.core.plugins.registry import installed

__all__ = [
    "CheckFailed",
    "CheckReport",
    "PluginCheck",
    "check_device",
    "check_effect",
    "check_estimator",
    "check_indenter",
    "check_profile",
    "check_rig",
    "check_sensor",
    "check_task",
    "device_checks",
    "effect_checks",
    "estimator_checks",
    "indenter_checks",
    "profile_checks",
    "rig_checks",
    "sensor_checks",
    "task_checks",
]


@dataclass(frozen=True)
class PluginCheck:
    """One check of one plugin, to be called in a test; its text is its name.

    The checks of a plugin are run together, in one child process, when the first is called.
    """

    name: str
    why: str
    cure: str
    report: Callable[[], CheckReport]

    def __str__(self) -> str:
        return self.name

    def __call__(self) -> None:
        """Raise CheckFailed if the plugin fails it; skip the test with the reason if it is about what the plugin lacks.

        An expected failure is one of pytest's (xfail), with the reason that the plugin lists.
        """
        import pytest

        found = {one.check: one for one in self.report().outcomes}
        outcome = found.get(self.name, CheckOutcome(self.name, "failed", "checks", "it has not run"))
        if outcome.status == "skipped":
            pytest.skip(outcome.text)
        if outcome.status == "expected":
            pytest.xfail(outcome.text)
        if outcome.status == "failed":
            raise CheckFailed(outcome.where, f"{outcome.text}\nwhy: {self.why}\ndo:  {self.cure}")


def _report(kind: Kind, name: str, recording: Path | None = None) -> CheckReport:
    modes: tuple[Mode, ...] = ("passive",) if recording is None else ("passive", "recording")
    (subject,) = subjects_named(installed(), name, (kind,))
    return run_checks(subject, modes=modes, recording=recording)


def _checks(kind: Kind, name: str, recording: Path | None = None) -> list[PluginCheck]:
    @lru_cache(maxsize=1)
    def report() -> CheckReport:
        return _report(kind, name, recording)

    modes: tuple[Mode, ...] = ("passive",) if recording is None else ("passive", "recording")
    checks = [*checks_of(kind, *modes), *OF_THE_LIST]
    return [PluginCheck(one.name, one.why, one.cure, report) for one in checks]


def sensor_checks(name: str, *, recording: Path | None = None) -> list[PluginCheck]:
    """Return the checks of a sensor, for ``pytest.mark.parametrize``; with a `recording`, also those of that."""
    return _checks("sensor", name, recording)


def rig_checks(name: str) -> list[PluginCheck]:
    """Return the checks of a rig."""
    return _checks("rig", name)


def device_checks(name: str) -> list[PluginCheck]:
    """Return the checks of a force sensor or a motor."""
    return _checks("device", name)


def task_checks(name: str) -> list[PluginCheck]:
    """Return the checks of a task."""
    return _checks("task", name)


def estimator_checks(name: str) -> list[PluginCheck]:
    """Return the checks of an estimator."""
    return _checks("estimator", name)


def effect_checks(name: str) -> list[PluginCheck]:
    """Return the checks of an effect."""
    return _checks("effect", name)


def indenter_checks(name: str) -> list[PluginCheck]:
    """Return the checks of a shape of indenter."""
    return _checks("indenter", name)


def profile_checks(name: str) -> list[PluginCheck]:
    """Return the checks of a force profile."""
    return _checks("profile", name)


def check_sensor(name: str, *, recording: Path | None = None) -> CheckReport:
    """Run all checks of a sensor; raises UnknownNameError if there is none of that name, and nothing for a failure."""
    return _report("sensor", name, recording)


def check_rig(name: str) -> CheckReport:
    """Run all checks of a rig; see `check_sensor`."""
    return _report("rig", name)


def check_device(name: str) -> CheckReport:
    """Run all checks of a force sensor or a motor; see `check_sensor`."""
    return _report("device", name)


def check_task(name: str) -> CheckReport:
    """Run all checks of a task; see `check_sensor`."""
    return _report("task", name)


def check_estimator(name: str) -> CheckReport:
    """Run all checks of an estimator; see `check_sensor`."""
    return _report("estimator", name)


def check_effect(name: str) -> CheckReport:
    """Run all checks of an effect; see `check_sensor`."""
    return _report("effect", name)


def __getattr__(name: str) -> Any:
    """Import the strategies when they are asked for: they need hypothesis."""
    if name != "strategies":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return importlib.import_module("tactbench.core.conformance.strategies")


def check_indenter(name: str) -> CheckReport:
    """Run all checks of a shape of indenter; see `check_sensor`."""
    return _report("indenter", name)


def check_profile(name: str) -> CheckReport:
    """Run all checks of a force profile; see `check_sensor`."""
    return _report("profile", name)
