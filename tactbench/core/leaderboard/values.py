"""What a column of the table is sorted by: its text has units and marks of its own line by line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

Columns = Mapping[str, Sequence[Any]]
Values = Sequence[float | None]


def _per_row(known: Columns) -> Values:
    told = zip(known["predict_s"], known["batch_rows"], strict=True)
    return [spent / count if spent is not None and count else None for spent, count in told]


def _midpoint(known: Columns) -> Values:
    return _between(known, "ci_low", "ci_high")


def _between(known: Columns, first: str, last: str) -> Values:
    ends = zip(_if_known(first)(known), _if_known(last)(known), strict=True)
    return [None if low is None or high is None else (low + high) / 2 for low, high in ends]


def _as_is(key: str) -> Callable[[Columns], Values]:
    return lambda known: known[key]


def _if_known(key: str) -> Callable[[Columns], Values]:
    """Return the values under a key that rows of older folders may lack."""
    return lambda known: known.get(key) or [None] * len(known["score"])


def _from_ms(key: str) -> Callable[[Columns], Values]:
    return lambda known: [None if value is None else value / 1e3 for value in _if_known(key)(known)]


def _tail(known: Columns) -> Values:
    """Return 95th percentiles; of fewer calls than they need, the largest."""
    told = zip(_from_ms("latency_ms_p95")(known), _from_ms("latency_ms_max")(known), strict=True)
    return [largest if p95 is None else p95 for p95, largest in told]


VALUES: dict[str, Callable[[Columns], Values]] = {
    "score": _as_is("score"),
    "95 % interval": _midpoint,
    "beyond floor": _if_known("score_beyond_floor"),
    "95 % beyond": lambda known: _between(known, "beyond_floor_ci_low", "beyond_floor_ci_high"),
    "true error": _if_known("true_score"),
    "recordings right": _if_known("recordings_right"),
    "published": _as_is("published"),
    "baseline": _as_is("baseline"),
    "n test": _as_is("n_test"),
    "sessions": _as_is("n_sessions"),
    "sim": _as_is("sim_s"),
    "delay": _from_ms("answer_delay_ms"),
    "fit": _as_is("fit_s"),
    "latency p50": _from_ms("latency_ms_p50"),
    "p95": _tail,
    "batch/row": _per_row,
}
"""One value a row, from what the rows have under each key, by the column's name; times in seconds, intervals by their
middle. Other columns are sorted by their text."""
