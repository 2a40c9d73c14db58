"""Rows from a folder that anybody may have written: what cannot be a row of this version never gets into a table."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import ValidationError

from tactbench.core.spec.row import JSON_KEYS, ReplicatedRow

Row = dict[str, Any]

_LARGEST = 2**63
"""Whole numbers from here on have no place in a table; a seed may be any."""


def checked(rows: Iterable[object]) -> tuple[list[Row], list[str]]:
    """Return the rows that a table can be made of, and what is wrong with each of the others, in one sentence each."""
    good: list[Row] = []
    wrong: list[str] = []
    for given in rows:
        if not isinstance(given, dict):
            wrong.append("a row without a name: it is no row")
            continue
        row = with_added(given)
        if trouble := _fault(row):
            name = row.get("cell")
            wrong.append(f"{name if isinstance(name, str) else 'a row without a name'}: {trouble}")
        else:
            good.append(row)
    return good, wrong


def with_added(row: Row) -> Row:
    """Return a row with the keys of `_ADDED` that it lacks, as they are before anything is known."""
    fields = ReplicatedRow.model_fields
    lacking = {key: fields[key].get_default() for key in _ADDED if key not in row}
    return {**row, **lacking} if lacking else row


def _fault(row: Row) -> str:
    """Return why a row cannot be in a table, as a clause; empty if it can."""
    lacking = [key for key in JSON_KEYS if key not in row and key != "key"]
    if lacking:
        return f"its row is of another version (it lacks {', '.join(lacking[:3])}); run it again"
    try:
        ReplicatedRow.model_validate(row)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        return f"its {'.'.join(map(str, first['loc']))}: {first['msg']}"
    for key, value in row.items():
        if type(value) is int and abs(value) >= _LARGEST and key != "seed":
            return f"its {key} is larger than a table holds"
    if row["status"] == "done" and row["score"] is None:
        return "it is done and has no score"
    if any(type(count) is not int for count in row["counts"].values()):
        return "its counts are not all whole numbers"
    table = row["confusion"] or []
    for line in table:
        if not isinstance(line, list) or len(line) != len(table) or any(type(count) is not int for count in line):
            return "its confusion is no square of whole numbers"
    return ""


_ADDED = ("declared_task", "events", "operating_points")
"""Keys that rows of older folders lack; a key that is added to a row is added here."""
