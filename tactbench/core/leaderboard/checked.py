"""Rows from a folder that anybody may have written: what cannot be a row of this version never gets into a table."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from tactbench.core.leaderboard.records import JSON_KEYS
from tactbench.core.matrix.store.rows import fault_in_row
from tactbench.core.spec.row import ReplicatedRow

Row = dict[str, Any]

_LARGEST = 2**63
"""Whole numbers from here on have no place in a table; a seed may be any."""


def checked(rows: Iterable[object]) -> tuple[list[Row], list[str]]:
    """Return the rows that a table can be made of, and what is wrong with each of the others, in one sentence each."""
    good: list[Row] = []
    wrong: list[str] = []
    for given in rows:
        row = with_added(given) if isinstance(given, dict) else given
        trouble = (_mistyped(row) or _senseless(row)) if isinstance(row, dict) else "it is no row"
        if trouble:
            name = row.get("cell") if isinstance(row, dict) else None
            wrong.append(f"{name if isinstance(name, str) else 'a row without a name'}: {trouble}")
        elif isinstance(row, dict):
            good.append(row)
    return good, wrong


def with_added(row: Row) -> Row:
    """Return a row with the keys of `_ADDED` that it lacks, as they are before anything is known."""
    fields = ReplicatedRow.model_fields
    lacking = {key: fields[key].get_default() for key in _ADDED if key not in row}
    return {**row, **lacking} if lacking else row


def _mistyped(row: Row) -> str:
    lacking = [key for key in _STORED if key not in row]
    if lacking:
        return f"its row is of another version (it lacks {', '.join(lacking[:3])}); run it again"
    return fault_in_row(row)


def _senseless(row: Row) -> str:
    for key, value in row.items():
        if type(value) is int and abs(value) >= _LARGEST and key != "seed":
            return f"its {key} is larger than a table holds"
    if row["status"] == "done" and row["score"] is None:
        return "it is done and has no score"
    if not _WHOLE.issuperset(map(type, row["counts"].values())):
        return "its counts are not all whole numbers"
    return "" if _is_square(row["confusion"]) else "its confusion is no square of whole numbers"


def _is_square(confusion: list[Any] | None) -> bool:
    return confusion is None or all(
        isinstance(line, list) and len(line) == len(confusion) and all(type(count) is int for count in line)
        for line in confusion
    )


_ADDED = ("declared_task", "events", "operating_points")
"""Keys that rows of the oldest folders lack (``tests/kept_results``); a key that is added to a row is added here."""
_STORED = tuple(key for key in JSON_KEYS if key != "key")
_WHOLE = frozenset({int})
