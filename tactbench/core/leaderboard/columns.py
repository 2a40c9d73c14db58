"""The columns of a leaderboard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

COLUMNS = (
    "#", "sensor", "estimator", "score", "95 % interval", "beyond floor", "95 % beyond", "true error", "rank 95 %",
    "recordings right", "published", "baseline", "n test", "sessions", "sim", "delay", "fit", "latency p50", "p95",
    "batch/row",
)  # fmt: skip
NUMERIC = frozenset(COLUMNS) - {"sensor", "estimator"}
INTERVALS = ("95 % interval", "95 % beyond")
TIMED_COLUMNS = ("sim", "delay", "fit", "latency p50", "p95", "batch/row")
TIMED = frozenset(TIMED_COLUMNS)
"""Columns that no seed decides: they belong to the host that was timed."""
IF_KNOWN = {
    "beyond floor": "score_beyond_floor", "95 % beyond": "score_beyond_floor", "true error": "true_score",
    "recordings right": "recordings_right",
}  # fmt: skip
"""Columns that a table has where a row has this key: of errors of force, whose reference errs too, and of
classifications whose recordings are of one class each."""

SHOWN = {
    "#": "rank", "sensor": "sensor", "estimator": "estimator", "score": "score", "95 % interval": "interval",
    "beyond floor": "beyond_floor", "95 % beyond": "beyond_floor_interval", "true error": "true_error",
    "rank 95 %": "rank_interval",
    "recordings right": "recordings_right",
    "published": "published", "baseline": "baseline", "n test": "n_test",
    "sessions": "sessions", "sim": "sim", "delay": "answer_delay", "fit": "fit", "latency p50": "latency_p50",
    "p95": "latency_p95", "batch/row": "batch_row",
}  # fmt: skip
"""What each column is called where programs read its text: ``shown`` in JSON, ``shown_…`` in CSV and Parquet."""


def columns(known: Mapping[str, Sequence[Any]], *, times: bool) -> tuple[str, ...]:
    """Return the columns of a table with times, or of one without.

    Parameters
    ----------
    known
        What its rows have under each key.
    """
    lacking = {name for name, key in IF_KNOWN.items() if all(one is None for one in known.get(key) or ())}
    return tuple(name for name in COLUMNS if name not in lacking and (times or name not in TIMED))
