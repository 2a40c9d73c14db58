"""Running checks: each in a child process that may hang or crash, and what came of them all."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

from tactbench.core.conformance import (  # noqa: F401  # isort: skip  (their checks, in this order)
    sensor_spec,
    transducer,
    press,
    task,
    estimator,
    recorded,
    data_set,
)
from tactbench.core.conformance.check import (
    CHECKS,
    EVERY_KIND,
    Check,
    CheckFailed,
    CheckOutcome,
    CheckSkipped,
    Kind,
    Mode,
    Subject,
    line_in,
    unchanged,
)
from tactbench.core.errors import TimedOut, UnknownNameError, error_text
from tactbench.core.on_demand import contributed
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import PluginRow, Registry
from tactbench.core.pool import InProcess, Limits, Pool
from tactbench.core.recording.datasets import mapping_called, mappings_of

for _checks in contributed("tactbench.checks").values():
    _checks.load()

TIMEOUT_S = 60.0
"""Seconds that one check may take: the slowest of ours, a press on the largest skin, takes two on an idle core."""


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
        """Return the outcomes of a status: passed, failed or skipped."""
        return tuple(one for one in self.outcomes if one.status == status)

    @property
    def failed(self) -> tuple[CheckOutcome, ...]:
        """The checks that failed."""
        return self.of("failed")

    @property
    def ok(self) -> bool:
        """Whether nothing failed."""
        return not self.failed

    @property
    def level(self) -> str | None:
        """How much was shown; None: something failed, or only a recording was read."""
        passed = {one.check for one in self.of("passed")}
        if "passive" not in self.modes or self.failed or not passed:
            return None
        if "recording-is-of-a-real-unit" in passed:
            return "gold"
        return "silver" if any(one.needs and one.name in passed for one in CHECKS) else "bronze"

    @property
    def summary(self) -> str:
        """How many checks ran, and what came of them, in one line."""
        counts = ", ".join(f"{status} {len(self.of(status))}" for status in ("passed", "failed", "skipped"))
        return f"{self.kind} {self.name}: {counts}.{f' Level: {self.level}.' if self.level else ''}"

    def __str__(self) -> str:
        return "\n".join([*(f"{one.check}: {one.where}: {one.text}" for one in self.failed), self.summary])


def subjects_named(registry: Registry, name: str, kinds: Sequence[Kind] = EVERY_KIND) -> list[Subject]:
    """Return what is called `name`: descriptors of that name, or else all that a plugin of that name brings.

    Raises
    ------
    UnknownNameError
        If nothing is called so, and no plugin that failed to load.
    """
    families, rows = registry.families(), plugins_named(registry, name)
    every = [(kind, one) for kind in kinds if kind != "dataset" for one in families[f"{kind}s"].names()]
    brought = {one for row in rows for one in row.brings}
    mapping = mapping_called(name) if "dataset" in kinds else None
    files = [mapping] if mapping else [file for row in rows if not row.brings for file in mappings_of(row.module)]
    data_sets = [Subject("dataset", file.stem, str(file), "", registry) for file in files]
    found = [one for one in every if one[1] == name] or [one for one in every if " ".join(one) in brought]
    if not found and not data_sets and not any(row.status == "failed" for row in rows):
        raise UnknownNameError(
            "plugin", name, {one for _, one in every} | {row.entry_point for row in registry.plugins}
        )
    owned = [(kind, one, families[f"{kind}s"].owned(one)) for kind, one in found]
    plain = [Subject(kind, one, owner.module, owner.distribution, registry) for kind, one, owner in owned]
    return plain + data_sets


def plugins_named(registry: Registry, name: str) -> list[PluginRow]:
    """Return the plugins whose entry point, module or distribution is called `name`."""
    alike = name.lower().replace("_", "-")
    return [
        row
        for row in registry.plugins
        if name in (row.entry_point, row.module) or alike == row.distribution.lower().replace("_", "-")
    ]


def run_checks(
    subject: Subject,
    *,
    modes: Sequence[Mode] = ("passive",),
    recording: Path | None = None,
    rig_file: Path | None = None,
    operator: Operator | None = None,
    root: Path | None = None,
    isolated: bool = True,
    without: Collection[str] = (),
) -> CheckReport:
    """Run the checks of one plugin, each within limits.

    Parameters
    ----------
    modes
        Which checks. Where only a recording is read, the plugin's code is not imported.
    recording, rig_file, operator, root
        As :class:`Subject` has them.
    isolated
        Whether in a child process. Checks of the mode `invasive` are always run in this one, and without a limit of
        time: an interrupt must reach the rig.
    without
        Names of checks that are left out.
    """
    subject = replace(subject, recording=recording, rig_file=rig_file, operator=operator, root=root)
    checks = [one for one in checks_of(subject.kind, *modes) if one.name not in without]
    outcomes: dict[str, CheckOutcome] = {}
    while waiting := [one.name for one in checks if one.mode != "invasive" and one.name not in outcomes]:
        engine = Pool(1, Limits(timeout_s=TIMEOUT_S)) if isolated else InProcess()
        for name, given in engine.each(_Trier(subject, dict(outcomes)), waiting):
            if isinstance(given, BaseException):  # it hung or crashed; what is left is tried in another process
                late = isinstance(given, TimedOut)
                text = f"it took longer than {TIMEOUT_S:g} s and was stopped" if late else error_text(given)
                outcomes[name] = CheckOutcome(name, "skipped" if late else "failed", subject.module, text)
                break
            outcomes[name] = given
    for one in checks:
        if one.mode == "invasive":
            _Trier(subject, outcomes)(one.name)
    return CheckReport(subject.kind, subject.name, tuple(modes), tuple(outcomes[one.name] for one in checks))


@dataclass
class _Trier:
    """Tries checks by name in one process, one after the other, and keeps what came of them."""

    subject: Subject
    outcomes: dict[str, CheckOutcome]

    def __call__(self, name: str) -> CheckOutcome:
        return self.outcomes.setdefault(name, self._tried(name))

    def _tried(self, name: str) -> CheckOutcome:
        (one,) = [one for one in CHECKS if one.name == name]
        for before in filter(None, map(self.outcomes.get, one.needs)):
            if before.status != "passed":
                text = before.text if before.status == "skipped" else f"not tried, for {before.check} has not passed"
                return CheckOutcome(name, "skipped", "", text)
        began_s = time.perf_counter()
        try:
            with unchanged(self.subject) if one.mode == "passive" else nullcontext():
                one.run(self.subject)
            outcome = CheckOutcome(name, "passed")
        except CheckFailed as failure:
            advice = "" if failure.__cause__ is not None else one.cure
            outcome = CheckOutcome(name, "failed", failure.where, failure.text, advice)
        except CheckSkipped as reason:
            outcome = CheckOutcome(name, "skipped", "", str(reason))
        except (Exception, SystemExit) as error:
            line = line_in(self.subject.package, error.__traceback__) or self.subject.module
            outcome = CheckOutcome(name, "failed", line, error_text(error))
        return outcome._replace(seconds=round(time.perf_counter() - began_s, 3))
