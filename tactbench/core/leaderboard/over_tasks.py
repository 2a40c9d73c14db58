"""Several tasks in one number for each answer that was given to several: no ranking, and none of single scores."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.names import answer_name, sensor_name
from tactbench.core.tables.numbers import interval, score
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]

TITLE = "Over tasks · interquartile mean between the trivial baseline, 0, and the reference of each task, 1"
COLUMNS = ("sensor", "estimator", "protocol", "mean", "95 % interval", "tasks")
NUMERIC = frozenset({"mean", "95 % interval"})
NOTE = (
    "Over tasks: compare means of the same tasks only. The interval is over replicates; the tasks are those given, not "
    "a sample of all (docs/statistics.md)."
)
MOST_ROWS = 2000
"""Rows beyond which resampling all of them takes too long for a table."""


def over_tasks(rows: Sequence[Row]) -> TextTable | None:
    """Return the means of all answers that two tasks or more were given; None if there are none.

    A task that was asked under several splits is left out: none of them stands for it.
    """
    groups: dict[tuple[Any, ...], dict[str, list[Row]]] = {}
    for row in filter(_counts, rows):
        key = sensor_name(row), answer_name(row), visible(row["protocol"]), row["rig"]
        groups.setdefault(key, {}).setdefault(row["task"], []).append(row)
    alone = {
        key: [members[0] for _, members in sorted(tasks.items()) if len(members) == 1] for key, tasks in groups.items()
    }
    several = {key: members for key, members in sorted(alone.items()) if len(members) > 1}
    if not several or sum(map(len, several.values())) > MOST_ROWS:
        return None
    lines = []
    notes: dict[str, None] = {NOTE: None}
    for (sensor, answer, protocol, _), members in several.items():
        found = _mean(members)
        if found is None:
            continue
        value, low, high, left_out = found
        absent = {reason.partition(":")[0] for reason in left_out}
        names = ", ".join(visible(row["task"]) for row in members if row["task"] not in absent)
        texts = (score(value, "1"), interval(low, high, "1"), names)
        lines.append((sensor, answer, protocol, *texts))
        notes |= dict.fromkeys(visible(f"Not in the mean of {sensor}/{answer}: {reason}.") for reason in left_out)
    return TextTable(TITLE, COLUMNS, tuple(lines), NUMERIC, notes=tuple(notes)) if lines else None


def _counts(row: Row) -> bool:
    """Return whether a row is an answer that is averaged."""
    return bool(
        row["status"] == "done"
        and not row["is_baseline"]
        and not is_probe(row["protocol"])
        and row["split"] not in ("shuffled", "in-session")
        and row.get("replicates")
        and math.isfinite(row["score"])
    )


def _mean(members: Sequence[Row]) -> tuple[float, float, float, tuple[str, ...]] | None:
    """Return mean, interval and what is left out; None where fewer than two tasks are in it, or nothing can be told."""
    from tactbench.core.statistics.aggregate import aggregate

    try:
        found = aggregate(members)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return None  # rows of a stranger's folder: their replicates may be anything
    return (found.value, found.low, found.high, found.left_out) if found and found.tasks > 1 else None
