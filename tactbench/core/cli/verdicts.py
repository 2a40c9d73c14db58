"""``tactbench twin verify``: checks carried out, verdicts as a table."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tactbench.core.cli.grid import print_grid, print_records
from tactbench.core.cli.progress import progress
from tactbench.core.cli.screen import remark
from tactbench.core.errors import TactbenchError, UnknownNameError, UsageError
from tactbench.core.plugins.checks import Check, Verdict
from tactbench.core.plugins.registry import load_object

if TYPE_CHECKING:
    from pathlib import Path

    from tactbench.core.plugins.registry import Registry

Found = tuple[Check, Verdict, float]
"""A check, one of its verdicts, and the seconds the whole check took."""

_COLUMNS = ("", "check", "what", "found", "allowed", "unit", "s", "source")


def oracle_checks(registry: Registry, rig: str) -> list[Check]:
    """Return the rig's checks against its oracles; raises UsageError if it offers none."""
    where = registry.rigs[rig].verification
    if where is None:
        raise UsageError(f"The rig {rig!r} brings no oracles.", hint="See `tactbench show` with its name.")
    return list(load_object(where)())


def likeness_checks(registry: Registry, rig: str, sensors: Sequence[str], recordings: Path | None) -> list[Check]:
    """Return the rig's checks against real sensors, for the sensors asked for or for all with measured figures.

    Raises
    ------
    UsageError
        If the rig brings none, or a sensor has no figures to be held against.
    """
    where = registry.rigs[rig].likeness
    if where is None:
        raise UsageError(
            f"The rig {rig!r} is not held against real sensors.", hint="See `tactbench show` with its name."
        )
    chosen_sensors = [registry.sensors[name] for name in sensors] or [
        sensor for sensor in registry.sensors if getattr(sensor.spec, "likeness", ())
    ]
    checks = [check for sensor in chosen_sensors for check in load_object(where)(sensor, recordings)]
    if not checks:
        raise UsageError(
            f"There are no measured figures of {', '.join(sensor.name for sensor in chosen_sensors) or 'any sensor'}.",
            hint="State them in the sensor's spec (SensorSpec.likeness).",
        )
    return checks


def carry_out(checks: Sequence[Check], only: Sequence[str]) -> list[Found]:
    """Carry out the checks, or those named or of a group named in `only`; a check that raises is a failed verdict."""
    names = [check.name for check in checks] + [check.group for check in checks]
    for name in only:
        if name not in names:
            raise UnknownNameError("check or group of checks", name, list(dict.fromkeys(names)))
    chosen = [check for check in checks if not only or check.name in only or check.group in only]
    found: list[Found] = []
    unanswered: list[str] = []
    with progress() as display:
        display.begin("verify", len(chosen))
        for check in chosen:
            display.working(check.name)
            began = time.perf_counter()
            try:
                verdicts = list(check.run())
            except TactbenchError as error:
                verdicts = [Verdict("carried out", math.nan, 0.0, 0.0, note=f"{error} {error.hint or ''}".strip())]
            spent = time.perf_counter() - began
            found += [(check, verdict, spent) for verdict in verdicts]
            if not verdicts:
                unanswered.append(f"No answer: {check.name}: {check.title}")
            display.advance(check.name)
    for text in unanswered:
        remark(text)
    return found


def print_verdicts(found: Sequence[Found], shape: str, *, real: bool) -> None:
    """Print the verdicts, then on stderr how many were met."""
    if shape != "table":
        print_records([_record(*one) for one in found], shape)
    else:
        for group in dict.fromkeys(check.group for check, _, _ in found):
            rows = [one for one in found if one[0].group == group]
            kinds = ["" if verdict.met else "failed" for _, verdict, _ in rows]
            print_grid(group, _COLUMNS, _lines(rows), numeric=("found", "s"), kinds=kinds)
        notes: dict[str, dict[str, None]] = {}
        for check, verdict, _ in found:
            if not verdict.met and verdict.note:
                notes.setdefault(verdict.note, {})[f"{check.name}, {verdict.name}"] = None
        for note, names in notes.items():
            remark(f"Missed: {'; '.join(names)}:\n  {note}")
    met = sum(verdict.met for _, verdict, _ in found)
    remark(f"{met} of {len(found)} {'inside what real sensors show' if real else 'within their bounds'}.")


def _lines(rows: Sequence[Found]) -> list[dict[str, str]]:
    lines, before = [], ""
    for check, verdict, spent in rows:
        first = check.name != before
        before = check.name
        entries = ("ok" if verdict.met else "MISS", check.name if first else "", verdict.name, f"{verdict.found:.4g}",
                   _allowed(verdict), "" if verdict.unit == "1" else verdict.unit, f"{spent:.1f}" if first else "",
                   verdict.source)  # fmt: skip
        lines.append(dict(zip(_COLUMNS, entries, strict=True)))
    return lines


def _allowed(verdict: Verdict) -> str:
    if math.isinf(verdict.low):
        return f"<= {verdict.high:.4g}"
    if math.isinf(verdict.high):
        return f">= {verdict.low:.4g}"
    return f"{verdict.low:.4g} … {verdict.high:.4g}"


def _record(check: Check, verdict: Verdict, spent: float) -> dict[str, Any]:
    return {
        **{name: getattr(check, name) for name in ("group", "title")}, "check": check.name,
        "verdict": verdict.name, "met": verdict.met,
        **{name: _finite(getattr(verdict, name)) for name in ("found", "low", "high")},
        "unit": verdict.unit, "source": verdict.source, "note": verdict.note, "seconds": spent,
    }  # fmt: skip


def _finite(number: float) -> float | None:
    return float(number) if math.isfinite(number) else None
