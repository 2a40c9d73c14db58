"""Running checks: each in a child process that may hang or crash, and what came of them all."""

from __future__ import annotations

import importlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from tactbench.core.conformance import (  # noqa: F401  # isort: skip  (their checks, in this order)
    code,
    sensor_spec,
    transducer,
    press,
    driver,
    task,
    estimator,
    simulated,
    recorded,
    invasive,
)
from tactbench.core.conformance.check import (
    CHECKS,
    KINDS,
    Check,
    CheckFailed,
    CheckOutcome,
    CheckSkipped,
    Kind,
    Mode,
    Subject,
    check,
    fail,
    line_in,
    said,
)
from tactbench.core.errors import CellStopped, UnknownNameError
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import PluginRow, Registry
from tactbench.core.pool import InProcess, Limits, Pool

TIMEOUT_S = 60.0
"""Seconds that one check may take: the slowest of ours, a press on the largest skin, takes two on an idle core."""
LISTED = "EXPECTED_FAILURES"
"""Name in a plugin's module: by name of a descriptor, checks that fail and why they may."""
Level = Literal["bronze", "silver", "gold"]


def checks_of(kind: Kind, *modes: Mode) -> tuple[Check, ...]:
    """Return the checks of a kind of plugin in some modes, in their order."""
    return tuple(one for one in CHECKS if kind in one.kinds and one.mode in modes)


@dataclass(frozen=True)
class CheckReport:
    """What came of the checks of one plugin."""

    kind: Kind
    name: str
    modes: tuple[Mode, ...]
    outcomes: tuple[CheckOutcome, ...] = field(repr=False)

    def of(self, status: str) -> tuple[CheckOutcome, ...]:
        """Return the outcomes of a status: passed, failed, skipped or expected."""
        return tuple(one for one in self.outcomes if one.status == status)

    @property
    def failed(self) -> tuple[CheckOutcome, ...]:
        """The checks that failed, unexpectedly."""
        return self.of("failed")

    @property
    def ok(self) -> bool:
        """Whether nothing failed unexpectedly."""
        return not self.failed

    @property
    def level(self) -> Level | None:
        """How much was shown; None: something failed, or only a recording was read."""
        passed = {one.check for one in self.of("passed")}
        if "passive" not in self.modes or self.failed or self.of("expected") or not passed:
            return None
        if not any(one.carries_out and one.name in passed for one in checks_of(self.kind, *self.modes)):
            return "bronze"
        return "gold" if "recording-is-of-a-real-unit" in passed else "silver"

    @property
    def summary(self) -> str:
        """How many checks ran, and what came of them, in one line."""
        counts = ", ".join(f"{status} {len(self.of(status))}" for status in ("passed", "failed", "skipped", "expected"))
        return f"{self.kind} {self.name}: {counts}.{f' Level: {self.level}.' if self.level else ''}"

    def __str__(self) -> str:
        return "\n".join([*(f"{one.check}: {one.where}: {one.text}" for one in self.failed), self.summary])


def subjects_named(registry: Registry, name: str, kinds: Sequence[Kind] = KINDS) -> list[Subject]:
    """Return what is called `name`: descriptors of that name, or else all that a plugin of that name brings.

    Raises
    ------
    UnknownNameError
        If nothing is called so, and no plugin that failed to load.
    """
    families = registry.families()
    rows = plugins_named(registry, name)
    found: list[tuple[Any, str]] = [(kind, name) for kind in kinds if name in families[f"{kind}s"]]
    if not found:
        brought = (one.partition(" ") for row in rows for one in row.brings)
        found = [(kind, one) for kind, _, one in brought if kind in kinds]
    if not found and not any(row.status == "failed" for row in rows):
        known = {one for kind in kinds for one in families[f"{kind}s"].names()}
        raise UnknownNameError("plugin", name, known | {row.entry_point for row in registry.plugins})
    owned = [(kind, one, families[f"{kind}s"].owned(one)) for kind, one in found]
    return [Subject(kind, one, owner.module, owner.distribution, registry) for kind, one, owner in owned]


def plugins_named(registry: Registry, name: str) -> list[PluginRow]:
    """Return the plugins whose entry point, module or distribution is called `name`."""
    alike = name.lower().replace("_", "-")
    return [
        row
        for row in registry.plugins
        if name in (row.entry_point, row.module) or alike == row.distribution.lower().replace("_", "-")
    ]


def failed_plugins(registry: Registry) -> Iterator[str]:
    """Yield a line for every plugin that could not be used: what is asked for may be in one of them."""
    for row in registry.failures:
        yield f"{row.entry_point} ({row.module} of {row.distribution} {row.version}): {row.reason}"
    for error in registry.refused:
        yield str(error)


def run_checks(
    subject: Subject,
    *,
    modes: Sequence[Mode] = ("passive",),
    recording: Path | None = None,
    rig_file: Path | None = None,
    operator: Operator | None = None,
    isolated: bool = True,
    timeout_s: float = TIMEOUT_S,
    without: Collection[str] = (),
) -> CheckReport:
    """Run the checks of one plugin, each within limits.

    Parameters
    ----------
    modes
        Which checks. Where only a recording is read, the plugin's code is not imported.
    recording, rig_file
        What the modes `recording` and `invasive` read.
    operator
        Who stands at the rig in the mode `invasive`; None: nobody.
    isolated
        Whether in a child process; else in this one, for plugins that are trusted. Checks of the mode `invasive` are
        always run in this one, and without a limit of time: an interrupt must reach the rig.
    without
        Names of checks that are left out.
    """
    subject = replace(subject, recording=recording, rig_file=rig_file, operator=operator)
    checks = [one for one in checks_of(subject.kind, *modes) if one.name not in without]
    outcomes: dict[str, CheckOutcome] = {}
    while waiting := [one.name for one in checks if one.mode != "invasive" and one.name not in outcomes]:
        engine = Pool(1, Limits(timeout_s=timeout_s)) if isolated else InProcess()
        for name, given in engine.each(_Carrier(subject, tuple(modes), dict(outcomes)), waiting):
            if isinstance(given, BaseException):
                outcomes[name] = _stopped(name, given, subject)
                break  # what is left is tried in another process
            outcomes[name] = given
    here = _Carrier(subject, tuple(modes), outcomes)
    for one in checks:
        if one.name not in outcomes:
            outcomes[one.name] = here(one.name)
    return CheckReport(subject.kind, subject.name, tuple(modes), tuple(outcomes[one.name] for one in checks))


class _Carrier:
    """Carries out checks by name in one process, one after the other."""

    def __init__(self, subject: Subject, modes: tuple[Mode, ...], outcomes: dict[str, CheckOutcome]) -> None:
        self._subject = subject
        self._modes = modes
        self._outcomes = outcomes

    def __call__(self, name: str) -> CheckOutcome:
        """Return what comes of a check, in the light of the failures that are expected."""
        (one,) = [one for one in checks_of(self._subject.kind, *self._modes) if one.name == name]
        outcome = self._tried(one)
        self._outcomes[name] = outcome
        reason = {} if self._modes == ("recording",) else expected_of(self._subject)
        if name in reason and outcome.status == "failed":
            return outcome._replace(status="expected", text=reason[name])
        if name in reason and outcome.status == "passed":
            return outcome._replace(status="failed", where=LISTED, text=f"it passes: take it off ({reason[name]})")
        return outcome

    def _tried(self, one: Check) -> CheckOutcome:
        for name in one.needs:
            before = self._outcomes.get(name)
            if before is not None and before.status != "passed":
                text = before.text if before.status == "skipped" else f"not tried, for {name} has not passed"
                return CheckOutcome(one.name, "skipped", "", text)
        try:
            one.run(self._subject)
        except CheckFailed as failure:
            advice = "" if failure.__cause__ is not None else one.cure
            return CheckOutcome(one.name, "failed", failure.where, failure.text, advice)
        except CheckSkipped as reason:
            return CheckOutcome(one.name, "skipped", "", str(reason))
        except (Exception, SystemExit) as error:
            line = line_in(self._subject.package, error.__traceback__) or self._subject.module
            return CheckOutcome(one.name, "failed", line, said(error))
        return CheckOutcome(one.name, "passed")


def _stopped(name: str, error: BaseException, subject: Subject) -> CheckOutcome:
    """Return the failure of a check that hung or crashed."""
    return CheckOutcome(name, "failed", subject.module, str(error) if isinstance(error, CellStopped) else said(error))


def expected_of(subject: Subject) -> dict[str, str]:
    """Return the failures that a plugin expects, with its reasons."""
    try:
        listed = dict(getattr(importlib.import_module(subject.module), LISTED, {}).get(subject.name, {}))
    except Exception:
        return {}  # a module that cannot be imported fails every check
    return {str(name): str(reason) for name, reason in listed.items()}


@check(*KINDS)
def expected_failures_are_checks(subject: Subject) -> None:
    """A list of expected failures grows old: a name that is no check excuses nothing.

    Correct the names in EXPECTED_FAILURES of the plugin's module, or take them off.
    """
    known = {one.name for one in checks_of(subject.kind, "passive", "invasive", "recording")}
    for name in sorted(set(expected_of(subject)) - known):
        fail(f"{subject.module}.{LISTED}[{subject.name}][{name}]", "no check has this name")
