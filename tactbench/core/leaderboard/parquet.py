"""The table as Parquet: typed columns, lists and tables as JSON text, versions and provenance as metadata."""

from __future__ import annotations

import io
from typing import Any

import tactbench
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.records import NESTED, RANK_KEYS, json_text, keys, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.text import visible

FORMAT_VERSION = "1"

_WHOLE = frozenset({
    "repeat", "repeats", "seed", "signal", "n_recordings", "n_sessions", "n_train", "n_test", "batch_rows", "latency_n",
    "threads", "concurrency", "rank", "rank_low", "rank_high",
})  # fmt: skip
_BOOLEAN = frozenset({"is_baseline", "simulated", "dagger", "rank_tied"})
_FLOAT = frozenset({
    "score", "ci_low", "ci_high", "baseline", "published", "sim_s", "search_s", "fit_s", "predict_s", "latency_ms_p50",
    "latency_ms_p95", "peak_rss_mb", "wall_s", "equivalence", "reference_score",
})  # fmt: skip


def parquet(table: Table) -> bytes:
    """Return a table's records as a Parquet file.

    Raises
    ------
    UsageError
        If pyarrow is not installed, or a number of a row has no place in 64 bits.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise UsageError(
            f"Parquet needs pyarrow, which cannot be imported: {error}.",
            hint="Install it with `pip install 'tactbench[parquet]'`.",
        ) from error
    types = {"whole": pa.int64(), "boolean": pa.bool_(), "float": pa.float64(), "text": pa.string()}
    names = [*keys(table), *RANK_KEYS]
    shown_names = [f"shown_{SHOWN[name]}" for name in table.columns]
    values: dict[str, list[Any]] = {name: [] for name in (*names, *shown_names)}
    for row, shown in records(table):
        for name, value in row.items():
            values[name].append(_stored(name, value))
        for name, text in zip(shown_names, shown.values(), strict=True):
            values[name].append(text)
    metadata = {
        "tactbench.format": "tactbench-leaderboard",
        "tactbench.format_version": FORMAT_VERSION,
        "tactbench.version": tactbench.__version__,
        "tactbench.provenance": json_text(list(table.provenance), sort_keys=True),
    }
    schema = pa.schema([(name, types[kind(name)]) for name in values], metadata=metadata)
    out = io.BytesIO()
    try:
        pq.write_table(pa.table(values, schema=schema), out, compression="zstd")
    except (pa.ArrowException, OverflowError) as error:
        raise UsageError(f"These rows do not fit Parquet: {error}.", hint="Use --format json.") from error
    return out.getvalue()


def kind(name: str) -> str:
    """Return what a column holds: whole, float, boolean or text."""
    for told, members in (("whole", _WHOLE), ("boolean", _BOOLEAN), ("float", _FLOAT)):
        if name in members:
            return told
    return "text"


def _stored(name: str, value: Any) -> Any:
    if name in NESTED:
        return json_text(value)
    if value is None or kind(name) == "boolean":
        return value
    if kind(name) == "float":
        return float(value)
    return value if kind(name) == "whole" else visible(str(value))
