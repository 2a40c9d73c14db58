"""What a column of the table is sorted by: its text has units and marks of its own line by line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Row = Mapping[str, Any]


def _per_row(row: Row) -> float | None:
    return row["predict_s"] / row["batch_rows"] if row["predict_s"] is not None and row["batch_rows"] else None


def _midpoint(row: Row) -> float | None:
    low, high = row["ci_low"], row["ci_high"]
    return None if low is None or high is None else (low + high) / 2


def _seconds(name: str) -> Callable[[Row], float | None]:
    return lambda row: None if row[name] is None else row[name] / 1e3


VALUES: dict[str, Callable[[Row], float | None]] = {
    "score": lambda row: row["score"],
    "95 % interval": _midpoint,
    "published": lambda row: row["published"],
    "baseline": lambda row: row["baseline"],
    "n test": lambda row: row["n_test"],
    "sessions": lambda row: row["n_sessions"],
    "sim": lambda row: row["sim_s"],
    "fit": lambda row: row["fit_s"],
    "latency p50": _seconds("latency_ms_p50"),
    "p95": _seconds("latency_ms_p95"),
    "batch/row": _per_row,
}
"""By the column's name; times in seconds, intervals by their middle. Other columns are sorted by their text."""
