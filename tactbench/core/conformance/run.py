"""Running of checks in a child process, as a check may hang or crash, and the report of outcomes."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from tactbench.core.conformance import (  # noqa: F401  # isort: skip  (their checks, in this order)
    sensor,
    press,
    task,
    estimator,
    recorded,
)
from tactbench.core.conformance.check import (
    CHECKS,
    EVERY_KIND,
    Check,
    CheckFailed,
    CheckOutcome,
    CheckSkipped,
    Kind,
    Subject,
    code_of,
    skip,
    unchanged,
)
from tactbench.core.errors import TimedOut, UnknownNameError, error_text
from tactbench.core.on_demand import contributed
from tactbench.core.plugins.registry import PluginRow, Registry
from tactbench.core.pool import InProcess, Limits, Pool
from tactbench.core.recording.datasets import mapping_called, mappings_of

for _checks in contributed("tactbench.checks").values():
    _checks.load()

TIMEOUT_S = 60.0
"""Time limit of one check [s]; the slowest in tactbench, on the largest skin, takes 2 s on an idle core."""


def checks_of(kind: Kind) -> tuple[Check, ...]:
    """Return the checks of a kind of plugin in their order."""
    return tuple(one for one in CHECKS if kind in one.kinds)


@dataclass(frozen=True)
class CheckReport:
    """Report of the outcomes of the checks of one plugin."""

    kind: Kind
    name: str
    outcomes: tuple[CheckOutcome, ...] = field(repr=False)

    def of(self, status: str) -> tuple[CheckOutcome, ...]:
        """Return the outcomes with a status: passed, failed or skipped."""
        return tuple(one for one in self.outcomes if one.status == status)

    @property
    def failed(self) -> tuple[CheckOutcome, ...]:
        """Outcomes of the checks that failed."""
        return self.of("failed")

    @property
    def ok(self) -> bool:
        """True if no check failed."""
        return not self.failed

    @property
    def level(self) -> str | None:
        """Highest level of conformance of which every check has passed; None if any check failed."""
        passed = {one.check for one in self.of("passed")}
        if self.failed or not passed:
            return None
        if "recording-is-of-a-real-unit" in passed:
            return "gold"
        return "silver" if any(one.needs and one.name in passed for one in CHECKS) else "bronze"

    @property
    def summary(self) -> str:
        """Counts of checks by status, as one line of text."""
        counts = ", ".join(f"{status} {len(self.of(status))}" for status in ("passed", "failed", "skipped"))
        return f"{self.kind} {self.name}: {counts}.{f' Level: {self.level}.' if self.level else ''}"

    def __str__(self) -> str:
        return "\n".join([*(f"{one.check}: {one.where}: {one.text}" for one in self.failed), self.summary])


def subjects_named(registry: Registry, name: str, kinds: Sequence[Kind] = EVERY_KIND) -> list[Subject]:
    """Return the descriptors called `name`, or else all descriptors of the plugin of this name.

    Raises
    ------
    UnknownNameError
        If there is no such descriptor, and no plugin of this name that failed to load.
    """
    rows = plugins_named(registry, name)
    every = [(kind, one) for kind in kinds if kind != "dataset" for one in registry.families()[f"{kind}s"].all_owned()]
    offered = {one for row in rows for one in row.brings}
    mapping = mapping_called(name) if "dataset" in kinds else None
    files = [mapping] if mapping else [file for row in rows if not row.brings for file in mappings_of(row.module)]
    found = [(kind, one) for kind, one in every if one.descriptor.name == name] or [
        (kind, one) for kind, one in every if f"{kind} {one.descriptor.name}" in offered
    ]
    if not found and not files and not any(row.status == "failed" for row in rows):
        known = {one.descriptor.name for _, one in every} | {row.entry_point for row in registry.plugins}
        raise UnknownNameError("plugin", name, known)
    return [Subject(kind, one.descriptor.name, one.module, one.distribution, registry) for kind, one in found] + [
        Subject("dataset", file.stem, str(file), "", registry) for file in files
    ]


def plugins_named(registry: Registry, name: str) -> list[PluginRow]:
    """Return the plugins whose entry point, module or distribution is called `name`."""
    alike = name.lower().replace("_", "-")
    return [
        row
        for row in registry.plugins
        if name in (row.entry_point, row.module) or alike == row.distribution.lower().replace("_", "-")
    ]


def run_checks(subject: Subject, *, isolated: bool = True, without: Collection[str] = (), **fields: Any) -> CheckReport:
    """Run the checks of one plugin, each within a time limit.

    Parameters
    ----------
    isolated
        True: run in a child process.
    without
        Names of checks to leave out.
    fields
        Values of the subject's fields `recording` and `root`.
    """
    subject = replace(subject, **fields)
    checks = [one for one in checks_of(subject.kind) if one.name not in without]
    outcomes: dict[str, CheckOutcome] = {}
    while waiting := [one.name for one in checks if one.name not in outcomes]:
        engine = Pool(1, Limits(timeout_s=TIMEOUT_S)) if isolated else InProcess()
        for name, given in engine.each(partial(_tried, subject, dict(outcomes)), waiting):
            if isinstance(given, BaseException):  # it hung or crashed; the remaining checks run in another process
                late = isinstance(given, TimedOut)
                text = f"the check took longer than {TIMEOUT_S:g} s and was stopped" if late else error_text(given)
                outcomes[name] = CheckOutcome(name, "skipped" if late else "failed", subject.module, text)
                break
            outcomes[name] = given
    return CheckReport(subject.kind, subject.name, tuple(outcomes[one.name] for one in checks))


def _tried(subject: Subject, outcomes: dict[str, CheckOutcome], name: str) -> CheckOutcome:
    """Run a check unless a check that it needs has not passed; add the outcome to `outcomes`."""
    (one,) = [one for one in CHECKS if one.name == name]
    began_s, outcome = time.perf_counter(), CheckOutcome(name, "passed")
    try:
        for before in filter(None, map(outcomes.get, one.needs)):
            if before.status != "passed":
                skip(before.text if before.status == "skipped" else f"not tried, as {before.check} has not passed")
        with unchanged(subject), code_of(subject.module, subject):
            one.run(subject)
    except CheckFailed as failure:
        advice = "" if failure.__cause__ is not None else one.cure
        outcome = CheckOutcome(name, "failed", failure.where, failure.text, advice)
    except CheckSkipped as reason:
        outcome = CheckOutcome(name, "skipped", "", str(reason))
    outcomes[name] = outcome._replace(seconds=round(time.perf_counter() - began_s, 3))
    return outcomes[name]
