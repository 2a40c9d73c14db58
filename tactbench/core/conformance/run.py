"""Running checks: each in a child process that may hang or crash, and what came of them all."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from tactbench.core.conformance.check import (
    KINDS,
    Check,
    CheckFailed,
    CheckOutcome,
    CheckSkipped,
    Kind,
    Level,
    Mode,
    line_in,
)
from tactbench.core.conformance.kit import FLOORS, checks_of, enough_checks_ran, expected_failures_are_checks
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import CellStopped, UnknownNameError
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import PluginRow, Registry
from tactbench.core.pool import InProcess, Limits, Pool

TIMEOUT_S = 30.0
"""Seconds that one check may take: the slowest of ours, a press on the largest skin, takes two."""
LISTED = "EXPECTED_FAILURES"
"""Name in a plugin's module: by name of a descriptor, checks that fail and why they may."""
_NOT_TRIED = "not tried, for "
_SILVER: Mapping[Kind, tuple[str, ...]] = {
    "sensor": ("press-is-recorded",),
    "rig": ("press-is-recorded", "real-rig-presses"),
    "device": ("driver-reads",),
    "task": (),
    "estimator": ("answers-have-the-shape",),
    "effect": ("it-is-applied",),
    "indenter": ("indenter-is-pressed",),
    "profile": ("path-is-recorded",),
}
"""Checks of which one must have run for silver: a plugin without any is not worse, it has shown less."""


@dataclass(frozen=True)
class CheckReport:
    """What came of the checks of one plugin."""

    kind: Kind
    name: str
    modes: tuple[Mode, ...]
    outcomes: tuple[CheckOutcome, ...] = field(repr=False)

    def _named(self, status: str) -> tuple[CheckOutcome, ...]:
        return tuple(one for one in self.outcomes if one.status == status)

    @property
    def passed(self) -> tuple[CheckOutcome, ...]:
        """The checks that passed."""
        return self._named("passed")

    @property
    def failed(self) -> tuple[CheckOutcome, ...]:
        """The checks that failed, unexpectedly."""
        return self._named("failed")

    @property
    def skipped(self) -> tuple[CheckOutcome, ...]:
        """The checks of what the plugin lacks, with what that is."""
        return self._named("skipped")

    @property
    def expected(self) -> tuple[CheckOutcome, ...]:
        """The checks that failed and are listed, with the reason that is listed."""
        return self._named("expected")

    @property
    def ran(self) -> int:
        """How many checks ran."""
        return len(self.outcomes) - len(self.skipped)

    @property
    def ok(self) -> bool:
        """Whether nothing failed unexpectedly, and enough ran."""
        return not self.failed

    @property
    def level(self) -> Level | None:
        """How much is proved; None: not even bronze, or only a recording was read."""
        status = {one.check: one.status for one in self.outcomes}
        if "passive" not in self.modes or status.get(enough_checks_ran.name) != "passed":
            return None
        checks = {one.name: one for one in checks_of(self.kind, *self.modes)}
        unmet = {checks[name].level for name, one in status.items() if one in ("failed", "expected") and name in checks}
        if "bronze" in unmet:
            return None
        asked = _SILVER[self.kind]
        silver = "silver" not in unmet and (not asked or any(status.get(name) == "passed" for name in asked))
        if not silver:
            return "bronze"
        real = status.get("recording-is-of-a-real-unit") == "passed" and "gold" not in unmet
        return "gold" if real else "silver"

    @property
    def summary(self) -> str:
        """How many checks ran, and what came of them, in one line."""
        parts = (
            f"ran {self.ran}", f"passed {len(self.passed)}", f"failed {len(self.failed)}",
            f"skipped {len(self.skipped)}", f"expected failures {len(self.expected)}",
        )  # fmt: skip
        level = f" Level: {self.level or 'none'}." if "passive" in self.modes else ""
        return f"{self.kind} {self.name}: {', '.join(parts)}.{level}"

    def __str__(self) -> str:
        return "\n".join([*(f"{one.check}: {one.where}: {one.text}" for one in self.failed), self.summary])


def subjects_named(registry: Registry, name: str, kinds: Sequence[Kind] = KINDS) -> list[Subject]:
    """Return what is called `name`: descriptors of that name, or else all that a plugin of that name brings.

    Raises
    ------
    UnknownNameError
        If nothing is called so, and no plugin that failed to load.
    """
    found = [_subject(registry, kind, name) for kind in kinds if name in registry.families()[f"{kind}s"]]
    if found:
        return found
    for row in plugins_named(registry, name):
        for brought in row.brings:
            kind, _, one = brought.partition(" ")
            if kind in kinds:
                found.append(_subject(registry, kind, one))  # type: ignore[arg-type]
    if not found and not any(row.status == "failed" for row in plugins_named(registry, name)):
        known = {one for kind in kinds for one in registry.families()[f"{kind}s"].names()}
        raise UnknownNameError("plugin", name, known | {row.entry_point for row in registry.plugins})
    return found


def plugins_named(registry: Registry, name: str) -> list[PluginRow]:
    """Return the plugins whose entry point, module or distribution is called `name`."""
    alike = name.lower().replace("_", "-")
    return [
        row
        for row in registry.plugins
        if name in (row.entry_point, row.module) or alike == row.distribution.lower().replace("_", "-")
    ]


def _subject(registry: Registry, kind: Kind, name: str) -> Subject:
    owned = registry.families()[f"{kind}s"].owned(name)
    return Subject(kind, name, owned.module, owned.distribution, registry)


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
    done: Callable[[CheckOutcome], None] = lambda outcome: None,
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
        Names of checks that are left out: they are reported as skipped.
    done
        Called with every outcome.
    """
    subject = replace(subject, recording=recording, rig_file=rig_file, operator=operator)
    checks = {one.name: one for one in checks_of(subject.kind, *modes)}
    expected = _expected(subject, isolated, timeout_s) if set(modes) != {"recording"} else {}
    outcomes: dict[str, CheckOutcome] = {}

    def settle(outcome: CheckOutcome) -> None:
        outcomes[outcome.check] = outcome = _weighed(outcome, expected)
        done(outcome)

    for name in without:
        if name in checks:
            settle(CheckOutcome(name, "skipped", "", "it was left out"))
    while waiting := [name for name, one in checks.items() if one.mode != "invasive" and name not in outcomes]:
        for name in waiting:
            blocked = _blocked(checks[name], outcomes)
            if blocked:
                settle(CheckOutcome(name, "skipped", "", blocked))
        waiting = [name for name in waiting if name not in outcomes]
        carrier = _Carrier(subject, _not_passed(outcomes), tuple(modes))
        for name, given in _carried_out(carrier, waiting, isolated, timeout_s):
            stopped = isinstance(given, BaseException)
            settle(_stopped(name, given, subject) if stopped else CheckOutcome(name, *given))
            if stopped:
                break  # what needs this check is not tried in another process
    here = _Carrier(subject, _not_passed(outcomes), tuple(modes))
    for name, one in checks.items():
        if name not in outcomes:
            blocked = _blocked(one, outcomes)
            settle(CheckOutcome(name, *(("skipped", "", blocked) if blocked else here(name))))
    if "passive" in modes:
        for check in (_only_checks(subject, expected), _enough(subject.kind, outcomes)):
            outcomes[check.check] = check
            done(check)
    return CheckReport(subject.kind, subject.name, tuple(modes), tuple(outcomes.values()))


def _not_passed(outcomes: Mapping[str, CheckOutcome]) -> tuple[str, ...]:
    return tuple(name for name, one in outcomes.items() if one.status != "passed")


def _carried_out(
    work: Callable[[str], Any], names: Sequence[str], isolated: bool, timeout_s: float
) -> Iterator[tuple[str, Any]]:
    """Yield each name with what `work` made of it, all in one child process, or in this one."""
    if not isolated:
        return InProcess().each(work, names)
    return Pool(1, Limits(timeout_s=timeout_s)).each(work, names)


class _Carrier:
    """Carries out checks by name in one process, one after the other."""

    def __init__(self, subject: Subject, failed: Sequence[str], modes: tuple[Mode, ...]) -> None:
        self._subject = subject
        self._modes = modes
        self._outcomes = {name: CheckOutcome(name, "skipped") for name in failed}

    def __call__(self, name: str) -> tuple[str, str, str]:
        """Return status, place and text of a check."""
        (check,) = [one for one in checks_of(self._subject.kind, *self._modes) if one.name == name]
        blocked = _blocked(check, self._outcomes)
        status, where, text = ("skipped", "", blocked) if blocked else self._tried(check)
        self._outcomes[name] = CheckOutcome(name, status, where, text)  # type: ignore[arg-type]
        return status, where, text

    def _tried(self, check: Check) -> tuple[str, str, str]:
        try:
            check.run(self._subject)
        except CheckFailed as failure:
            return "failed", failure.where, failure.text
        except CheckSkipped as reason:
            if _raised_by_a_check(reason):
                return "skipped", "", str(reason)
            return "failed", self._place(reason), "the plugin raised what skips a check"
        except (Exception, SystemExit) as error:
            return "failed", self._place(error), f"{type(error).__name__}: {error}"
        return "passed", "", ""

    def _place(self, error: BaseException) -> str:
        return line_in(self._subject.package, error.__traceback__) or self._subject.module


def _raised_by_a_check(error: BaseException) -> bool:
    """Whether the last frame is this package's: a plugin cannot skip its own checks."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and trace.tb_frame.f_globals.get("__name__", "").startswith(__package__)


def _blocked(check: Check, outcomes: Mapping[str, CheckOutcome]) -> str:
    """Return why a check cannot be tried; "" if it can."""
    for name in check.needs:
        before = outcomes.get(name)
        if before is None or before.status == "passed":
            continue
        if before.status == "skipped" and before.text:
            return before.text
        return f"{_NOT_TRIED}{name} has not passed"
    return ""


def _stopped(name: str, error: BaseException, subject: Subject) -> CheckOutcome:
    """Return the failure of a check that hung, crashed or came to an end that nobody foresaw."""
    text = str(error) if isinstance(error, CellStopped) else f"{type(error).__name__}: {error}"
    where = subject.module
    lines = [line.strip() for line in getattr(error, "traceback_text", "").splitlines() if subject.package in line]
    if lines:
        where = lines[0].replace('File "', "").replace('"', "")
    return CheckOutcome(name, "failed", where, text)


def _weighed(outcome: CheckOutcome, expected: Mapping[str, str]) -> CheckOutcome:
    """Return an outcome in the light of the failures that are expected."""
    reason = expected.get(outcome.check)
    if reason is None:
        return outcome
    if outcome.status == "failed":
        return outcome._replace(status="expected", text=reason)
    if outcome.status == "passed":
        return outcome._replace(status="failed", where=LISTED, text=f"it passes now: take it off the list ({reason})")
    return outcome


def _only_checks(subject: Subject, expected: Mapping[str, str]) -> CheckOutcome:
    known = {one.name for one in checks_of(subject.kind, "passive", "invasive", "recording")}
    for name in sorted(set(expected) - known):
        where = f"{subject.module}.{LISTED}[{subject.name}][{name}]"
        return CheckOutcome(expected_failures_are_checks.name, "failed", where, "no check has this name")
    return CheckOutcome(expected_failures_are_checks.name, "passed")


def _enough(kind: Kind, outcomes: Mapping[str, CheckOutcome]) -> CheckOutcome:
    # What another failure keeps from being tried is red already.
    ran = sum(one.status != "skipped" or one.text.startswith(_NOT_TRIED) for one in outcomes.values())
    if ran < FLOORS[kind]:
        reasons = "; ".join(sorted({one.text for one in outcomes.values() if one.status == "skipped"}))
        return CheckOutcome(
            enough_checks_ran.name, "failed", "checks", f"{ran} ran, and every {kind} can run {FLOORS[kind]}: {reasons}"
        )
    return CheckOutcome(enough_checks_ran.name, "passed")


def _expected(subject: Subject, isolated: bool, timeout_s: float) -> dict[str, str]:
    """Return the failures that a plugin expects, with its reasons; none where its module cannot be asked."""
    for _, given in _carried_out(partial(_listed, subject.name), [subject.module], isolated, timeout_s):
        if isinstance(given, Mapping):
            return dict(given)
    return {}


def _listed(name: str, module: str) -> dict[str, str]:
    listed: Any = getattr(importlib.import_module(module), LISTED, {})
    return {str(check): str(reason) for check, reason in dict(listed.get(name, {})).items()}


def failed_plugins(registry: Registry) -> Iterator[str]:
    """Yield a line for every plugin that could not be used: what is asked for may be in one of them."""
    for row in registry.failures:
        yield f"{row.entry_point} ({row.module} of {row.distribution} {row.version}): {row.reason}"
    for error in registry.refused:
        yield str(error)
