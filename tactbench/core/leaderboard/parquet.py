"""The table as Parquet: typed columns, lists and tables as JSON text, versions and provenance as metadata."""

from __future__ import annotations

import io
from typing import Any

import tactbench
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.records import NESTED, RANK_KEYS, keys, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.spec.row import FORMAT
from tactbench.core.tables.text import json_text, visible

FORMAT_VERSION = "1"

_RANKS = {"rank": "whole", "rank_low": "whole", "rank_high": "whole", "rank_tied": "boolean"}


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
    """Return what a column holds: whole, float, boolean or text; lists and tables are text."""
    types = FORMAT.get(name, frozenset())
    for label, one in (("boolean", bool), ("float", float), ("whole", int)):
        if one in types:
            return label
    return _RANKS.get(name, "text")


def _stored(name: str, value: Any) -> Any:
    if name in NESTED:
        return json_text(value)
    if value is None or kind(name) == "boolean":
        return value
    if kind(name) == "float":
        return float(value)
    return value if kind(name) == "whole" else visible(str(value))
