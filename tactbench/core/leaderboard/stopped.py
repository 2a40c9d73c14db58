"""What is said of cells that did not end well, or were not begun."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from tactbench.core.leaderboard.column_table import ColumnTable
from tactbench.core.leaderboard.names import asked_of, question_name
from tactbench.core.leaderboard.text import command_line, cut, visible
from tactbench.core.spec.status import STOPPED

Row = Mapping[str, Any]

MOST_NAMES = 8
"""Cells that ended alike and are named; the others are counted, and stand in the table."""
LONGEST_REASON = 600
"""Characters of a reason in a note; JSON, CSV and Parquet have all of it."""


def stopped_notes(by_key: ColumnTable, statuses: Collection[str]) -> list[str]:
    """Return one sentence for all cells that ended alike in one of `statuses`: which, why, how to look into it."""
    alike: dict[tuple[str, int | None, str], list[Row]] = {}
    for status, row in zip(by_key["status"], by_key.rows, strict=True):
        if status in statuses and status != "done":
            alike.setdefault((row["status"], row["signal"], row["reason"]), []).append(row)
    return [_told(status, signal, reason, members) for (status, signal, reason), members in alike.items()]


def _told(status: str, signal: int | None, reason: str, members: list[Row]) -> str:
    names = list(dict.fromkeys(f"{question_name(row)}/{asked_of(row)}" for row in members))
    more = len(names) - MOST_NAMES
    listed = ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
    by = f" by signal {signal}" if signal is not None else ""
    said = cut(visible(reason), LONGEST_REASON)
    told = f"{listed} {visible(status)}{by}: {said}"
    if status not in STOPPED:
        return told
    end = "" if told.endswith((".", "!", "?", "…")) else "."
    return f"{told}{end} Look into it: {command_line('tactbench', 'why', members[0]['cell'])}"
