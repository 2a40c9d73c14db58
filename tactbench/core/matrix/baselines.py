"""The score that every other one stands beside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Row = dict[str, Any]


def fill_baselines(rows: Sequence[Row]) -> None:
    """Write the score of the first baseline of each group beside every row of the group."""
    by_group: dict[tuple[Any, ...], float] = {}
    for row in rows:
        if row["is_baseline"] and row["status"] == "done":
            by_group.setdefault(_group(row), row["score"])
    for row in rows:
        row["baseline"] = by_group.get(_group(row))


def _group(row: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(row[key] for key in ("sensor", "task", "rig", "protocol", "split", "repeat"))
