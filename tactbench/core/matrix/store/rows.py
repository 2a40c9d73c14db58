"""What a row may hold: the types of its values, checked when it comes from a file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from tactbench.core.matrix.store.limits import DEPTH
from tactbench.core.spec.row import FORMAT, in_words
from tactbench.core.spec.status import STATUSES

Row = dict[str, Any]
"""One cell, as `tactbench.core.matrix.answer.opening` lays it out. What comes from a ledger shares its big values with
other rows: they are never changed in place."""

NAMING = ("cell", "repeat", "repeats")
"""What a matrix calls a cell; the key covers everything else."""

_INSIDE = tuple((name, held.inside) for name, held in FORMAT.items() if held.inside)
_NESTED = {dict, list}

_finite = json.JSONEncoder(sort_keys=True, allow_nan=False).encode


class NotPlainError(ValueError):
    """The row of a finished cell holds what is no plain data: nothing of it was written."""


def plain(row: Mapping[str, Any]) -> tuple[Row, str]:
    """Return a row as it reads when it comes back from a file, and its text: lists for tuples, keys in order.

    Raises
    ------
    NotPlainError
        If it holds what JSON has no word for.
    """
    try:
        text = _finite(row)
        back: Row = json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise NotPlainError(str(error)) from error
    return back, text


def row_checker() -> Callable[[Row], str]:
    """Return a function that says what is wrong with a row, or nothing.

    It remembers which combinations of keys and types it has seen, and which shared values: thousands of rows are alike.
    """
    alike: set[tuple[Any, ...]] = set()
    seen: dict[int, Any] = {}

    def wrong(row: Row) -> str:
        shape = (*row, *map(type, row.values()))
        if shape not in alike:
            said = _mistyped(row)
            if said:
                return said
            alike.add(shape)
        if row["status"] not in STATUSES:
            return f"a cell cannot be {row['status']!r}"
        for name, allowed in _INSIDE:
            values = row.get(name)
            if values and id(values) not in seen:
                inside: Iterable[Any] = values.values() if isinstance(values, dict) else values
                if not allowed.issuperset(map(type, inside)):
                    return f"{name!r} holds something else than {in_words(allowed)}"
                seen[id(values)] = values  # kept, so that no other object gets its id
        return ""

    return wrong


def _mistyped(row: Row) -> str:
    for name in ("cell", "status"):
        if name not in row:
            return f"it has no {name!r}"
    for name, value in row.items():
        held = FORMAT.get(name)
        if held is not None and type(value) not in held.types:
            return f"{name!r} is {in_words([type(value)])}, not {in_words(held.types)}"
    return ""


def too_deep(value: Any) -> bool:
    """Return whether lists and mappings, as JSON has them, lie in each other more than `DEPTH` deep."""
    level = [value]
    for _ in range(DEPTH):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if type(inner) in _NESTED
        ]
        if not level:
            return False
    return True


def named(row: Mapping[str, Any], naming: Mapping[str, Any]) -> Row:
    """Return `row` under the name that another row has."""
    return {**row, **{name: naming[name] for name in NAMING if name in naming}}
