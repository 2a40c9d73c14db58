"""What a row may hold: the types of its values, checked when it comes from a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from tactbench.core.matrix.store.limits import DEPTH
from tactbench.core.spec.row import ReplicatedRow, fault_in_scores

Row = dict[str, Any]
"""One cell, as `tactbench.core.spec.row.RowModel` describes it. What comes from a ledger shares its big values
with other rows: they are never changed in place."""

NAMING = ("cell", "repeat", "repeats")
"""What a matrix calls a cell; the key covers everything else."""

_NESTED = {dict, list}

_finite = json.JSONEncoder(sort_keys=True, allow_nan=False).encode


class NotPlainError(ValueError):
    """The row of a finished cell holds what is no plain data: nothing of it was written."""


def text_of(row: Mapping[str, Any]) -> str:
    """Return the text of a row, keys in order; raises NotPlainError if it holds what JSON has no word for."""
    try:
        return _finite(row)
    except (TypeError, ValueError, RecursionError) as error:
        raise NotPlainError(str(error)) from error


def fault_in_row(row: Row) -> str:
    """Return what is wrong with a row, as a clause; "" if nothing is."""
    try:
        ReplicatedRow.model_validate(row)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        return f"its {place}: {first['msg']}"
    return fault_in_scores(row)


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
