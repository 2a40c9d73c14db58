"""The columns of a leaderboard."""

from __future__ import annotations

COLUMNS = (
    "#", "sensor", "estimator", "score", "95 % interval", "rank 95 %", "published", "baseline", "n test", "sessions",
    "sim", "fit", "latency p50", "p95", "batch/row",
)  # fmt: skip
NUMERIC = frozenset(COLUMNS) - {"sensor", "estimator"}
TIMED = frozenset({"sim", "fit", "latency p50", "p95", "batch/row"})
"""Columns that no seed decides: they belong to the host that was timed."""

SHOWN = {
    "#": "rank", "sensor": "sensor", "estimator": "estimator", "score": "score", "95 % interval": "interval",
    "rank 95 %": "rank_interval", "published": "published", "baseline": "baseline", "n test": "n_test",
    "sessions": "sessions", "sim": "sim", "fit": "fit", "latency p50": "latency_p50", "p95": "latency_p95",
    "batch/row": "batch_row",
}  # fmt: skip
"""What each column is called where programs read its text: ``shown`` in JSON, ``shown_…`` in CSV and Parquet."""


def columns(times: bool) -> tuple[str, ...]:
    """Return the columns of a table with times, or of one without."""
    return COLUMNS if times else tuple(name for name in COLUMNS if name not in TIMED)
