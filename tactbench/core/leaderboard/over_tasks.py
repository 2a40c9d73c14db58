"""Several tasks in one number for each answer that was given to several: no ranking, and none of single scores."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import compress
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.numbers import interval, score
from tactbench.core.leaderboard.text import visible
from tactbench.core.leaderboard.text_table import TextTable

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


def over_tasks(by_key: ColumnTable) -> TextTable | None:
    """Return the means of all answers that two tasks or more were given; None if there are none.

    A task that was asked under several splits is left out: none of them stands for it.
    """
    groups: dict[tuple[Any, ...], dict[str, list[Row]]] = {}
    keys = (by_key.sensors, by_key.answers, map(visible, by_key["protocol"]), by_key["rig"])
    given = zip(zip(*keys, strict=True), by_key["task"], by_key.rows, strict=True)
    for key, task, row in compress(given, _counts(by_key)):
        groups.setdefault(key, {}).setdefault(task, []).append(row)
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


def _counts(by_key: ColumnTable) -> list[bool]:
    """Return which rows are answers that are averaged."""
    ours = {protocol: not is_probe(protocol) for protocol in set(by_key["protocol"])}
    keys = ("status", "is_baseline", "protocol", "split", "replicates", "score")
    return [
        status == "done"
        and not trivial
        and ours[protocol]
        and split not in ("shuffled", "in-session")
        and bool(replicates)
        and math.isfinite(score)
        for status, trivial, protocol, split, replicates, score in zip(*map(by_key.known, keys), strict=True)
    ]


def _mean(members: Sequence[Row]) -> tuple[float, float, float, tuple[str, ...]] | None:
    """Return mean, interval and what is left out; None where fewer than two tasks are in it, or nothing can be told."""
    from tactbench.core.statistics.aggregate import aggregate

    try:
        found = aggregate(members)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return None  # rows of a stranger's folder: their replicates may be anything
    return (found.value, found.low, found.high, found.left_out) if found and found.tasks > 1 else None
