"""What a row may hold: the types of its values, checked when it comes from a file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from tactbench.core.matrix.store.limits import DEPTH
from tactbench.core.spec.status import STATUSES

Row = dict[str, Any]
"""One cell, as `tactbench.core.matrix.answer.opening` lays it out. What comes from a ledger shares its big values with
other rows: they are never changed in place."""

NAMING = ("cell", "repeat", "repeats")
"""What a matrix calls a cell; the key covers everything else."""

_NONE = type(None)
_TYPES: dict[tuple[type, ...], tuple[str, ...]] = {
    (str,): (
        "key", "cell", "sensor", "task", "rig", "protocol", "estimator", "status", "reason", "traceback", "log",
        "metric", "unit", "ci_method", "published_reference", "published_remark", "host", "made_by",
    ),
    (str, _NONE): ("split",),
    (int,): ("repeat", "repeats", "seed"),
    (int, _NONE): (
        "signal", "n_recordings", "n_sessions", "n_train", "n_test", "batch_rows", "latency_n", "threads",
        "concurrency",
    ),
    (float, int, _NONE): (
        "score", "ci_low", "ci_high", "baseline", "published", "sim_s", "search_s", "fit_s", "predict_s",
        "latency_ms_p50", "latency_ms_p95", "peak_rss_mb", "wall_s",
    ),
    (bool,): ("is_baseline", "simulated", "dagger"),
    (list,): ("stamps", "remarks", "plan", "search", "recordings", "digests", "classes"),
    (list, _NONE): ("confusion",),
    (dict,): ("params", "simulation", "assumptions", "counts", "chosen", "scores", "replicates"),
}  # fmt: skip
_ALLOWED: dict[str, tuple[type, ...]] = {name: types for types, names in _TYPES.items() for name in names}

_NUMBER, _TEXT, _SCALAR = (int, float), (str,), (str, int, float, bool)
_INSIDE: dict[str, tuple[type, ...]] = {
    "stamps": _TEXT, "remarks": _TEXT, "recordings": _TEXT, "digests": _TEXT, "plan": (dict,), "search": (dict,),
    "classes": _SCALAR, "confusion": (list,), "counts": _NUMBER, "chosen": _NUMBER, "scores": _NUMBER,
}  # fmt: skip


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
    inner = [(name, types, frozenset(types)) for name, types in _INSIDE.items()]

    def wrong(row: Row) -> str:
        shape = (*row, *map(type, row.values()))
        if shape not in alike:
            said = _mistyped(row)
            if said:
                return said
            alike.add(shape)
        if row["status"] not in STATUSES:
            return f"a cell cannot be {row['status']!r}"
        for name, types, allowed in inner:
            values = row.get(name)
            if values and id(values) not in seen:
                inside: Iterable[Any] = values.values() if isinstance(values, dict) else values
                if not allowed.issuperset(map(type, inside)):
                    return f"{name!r} holds something else than {_words(types)}"
                seen[id(values)] = values  # kept, so that no other object gets its id
        return ""

    return wrong


def _mistyped(row: Row) -> str:
    for name in ("cell", "status"):
        if name not in row:
            return f"it has no {name!r}"
    for name, value in row.items():
        types = _ALLOWED.get(name)
        if types is not None and type(value) not in types:
            return f"{name!r} is {_words((type(value),))}, not {_words(types)}"
    return ""


def _words(types: Iterable[type]) -> str:
    names = {str: "text", int: "a whole number", float: "a number", bool: "yes or no", list: "a list",
             dict: "a mapping", _NONE: "nothing"}  # fmt: skip
    return " or ".join(names[one] for one in types)


_NESTED = {dict, list}


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
