"""A table as records for programs: JSON, CSV, Parquet and an Excel file, with the texts that people see.

The keys of rows, in order and in groups.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from typing import Any

import tactbench
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.names import metric_name
from tactbench.core.leaderboard.table import Table
from tactbench.core.spec.row import FORMAT, JSON_KEYS, NESTED, OF_REPLICATES
from tactbench.core.tables import csv_text as csv_format
from tactbench.core.tables.text import json_text, visible

RANK_KEYS = ("rank", "rank_low", "rank_high", "rank_tied")
"""Where a row stands in its block; they follow the keys of the row."""

GROUPS: dict[str, tuple[str, ...]] = {
    "Configuration": (
        "cell", "key", "sensor", "task", "rig", "simulated", "emulated", "protocol", "dagger", "split", "estimator",
        "is_baseline", "looks_at", "answer_per", "answer_from", "declared_task", "repeat", "repeats", "seed",
        "threads",
    ),
    "Answer": (
        "status", "reason", "signal", "metric", "unit", "score", "ci_low", "ci_high", "ci_method",
        "reference_floor", "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score",
        "true_ci_low", "true_ci_high", "tare_s", "baseline",
        "published", "published_reference", "published_remark", "equivalence", "reference_score", "n_recordings",
        "n_sessions", "n_train", "n_test",
    ),
    "Times and memory": (
        "sim_s", "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50", "latency_ms_p95",
        "latency_ms_max", "latency_n", "answer_delay_ms",
        "wall_s", "peak_rss_mb", "host", "concurrency", "made_by",
    ),
}  # fmt: skip
"""Single values; a key that is in no group comes last, so that none is ever left out."""

OF_THE_MACHINE = frozenset(GROUPS["Times and memory"]) | {
    "delay_parts_ms", "threads", "search", "recordings", "key", "events", "operating_points",
}  # fmt: skip
"""Keys that machine, place or hour decide, not the seed alone."""

TITLES = {
    "params": "Parameters other than the defaults",
    "chosen": "Chosen on validation data",
    "search": "Every candidate that was compared",
    "scores": "Other scores: by class, by fold, by other metrics",
    "events": "Events: at the threshold that validation recordings chose",
    "operating_points": "Events at thresholds for other bounds of false alarms",
    "delay_parts_ms": "Parts of the answer delay [ms]",
    "counts": "What was counted",
    "assumptions": "Assumed by the simulation",
    "plan": "Effects of the first recording: included and left out, with reasons",
    "confusion": "Confusion: true class down, answer across [rows]",
    "recordings": "Recordings",
    "remarks": "Remarks of the recordings",
    "stamps": "Stamps",
    "replicates": "What the interval is over",
}
"""Lists and tables."""

APART = ("traceback", "classes")
"""Shown in places of their own."""

FORMAT_VERSION = "1"
_RANKS = {"rank": int, "rank_low": int, "rank_high": int, "rank_tied": bool}
_FIRST = (*RANK_KEYS, "sensor", "estimator", "score")
_LONGEST_NAME, _LONGEST_TEXT = 31, 32_767
"""Characters that Excel takes in a sheet's name and in a cell."""


def keys(table: Table) -> tuple[str, ...]:
    """Return the keys that a table's records have, before their ranks."""
    every = (*JSON_KEYS, *OF_REPLICATES)
    return every if table.times else tuple(key for key in every if key not in OF_THE_MACHINE)


def records(table: Table) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
    """Yield each line's row, ranks among it, and its texts by what their columns are called for programs."""
    chosen = keys(table)
    for line in table.lines:
        one = line.placing
        ranks = (one.place, one.low, one.high, one.tied) if one else (None, None, None, None)
        row = {key: line.row.get(key) for key in chosen} | dict(zip(RANK_KEYS, ranks, strict=True))
        yield row, {SHOWN[name]: text for name, text in line.texts.items()}


def flat_records(table: Table) -> tuple[list[str], Iterator[list[Any]]]:
    """Return names of columns and lines for formats whose cells hold one value: lists and tables are JSON."""
    names = [*keys(table), *RANK_KEYS, *(f"shown_{SHOWN[name]}" for name in table.columns)]
    lines = ([*(_flat(*one) for one in row.items()), *shown.values()] for row, shown in records(table))
    return names, lines


def _flat(key: str, value: Any) -> Any:
    if key in NESTED:
        return json_text(value)
    return visible(value) if isinstance(value, str) else value


def csv_text(table: Table) -> str:
    """Return a leaderboard's records as CSV."""
    return csv_format.csv_text(*flat_records(table))


def json_array(table: Table) -> str:
    """Return a table's records as a JSON array, one a line: every key, and the text of its columns in ``shown``."""
    lines = (json_text(values | {"shown": shown}) for values, shown in records(table))
    return "[\n" + ",\n".join(lines) + "\n]\n"


def parquet(table: Table) -> bytes:
    """Return a table's records as a Parquet file: lists and tables as JSON text, versions and provenance as metadata.

    Raises
    ------
    UsageError
        If pyarrow is not installed, or a number of a row has no place in 64 bits.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise _lacking("Parquet", "pyarrow", "parquet", error) from error
    types = {bool: pa.bool_(), float: pa.float64(), int: pa.int64(), str: pa.string()}
    names, lines = flat_records(table)
    kinds = list(map(_kind, names))
    metadata = {
        "tactbench.format": "tactbench-leaderboard",
        "tactbench.format_version": FORMAT_VERSION,
        "tactbench.version": tactbench.__version__,
        "tactbench.provenance": json_text(list(table.provenance), sort_keys=True),
    }
    schema = pa.schema([(name, types[kind]) for name, kind in zip(names, kinds, strict=True)], metadata=metadata)
    columns = list(zip(*lines, strict=True)) or [()] * len(names)
    out = io.BytesIO()
    try:
        arrays = [
            [None if one is None else float(one) for one in column] if kind is float else list(column)
            for column, kind in zip(columns, kinds, strict=True)
        ]
        pq.write_table(pa.table(arrays, schema=schema), out, compression="zstd")
    except (pa.ArrowException, OverflowError) as error:
        raise UsageError(f"These rows do not fit Parquet: {error}.", hint="Use --format json.") from error
    return out.getvalue()


def _lacking(what: str, library: str, extra: str, error: ImportError) -> UsageError:
    return UsageError(
        f"{what} needs {library}, which cannot be imported: {error}.",
        hint=f"Install it with `pip install 'tactbench[{extra}]'`.",
    )


def _kind(name: str) -> type:
    """Return what a column holds: truth values, numbers, whole numbers or text; lists and tables are text."""
    types = FORMAT.get(name) or {_RANKS.get(name, str)}
    return next((one for one in (bool, float, int) if one in types), str)


def xlsx(table: Table) -> bytes:
    """Return a table's records as a workbook: a sheet a block, numbers as numbers, and a sheet of notes.

    Keys without any value in a block and those of lists are left out.

    Raises
    ------
    UsageError
        If openpyxl is not installed.
    """
    try:
        from openpyxl import Workbook
        from openpyxl.cell import WriteOnlyCell
    except ImportError as error:
        raise _lacking("An Excel file", "openpyxl", "xlsx", error) from error
    book = Workbook(write_only=True)

    def put(sheet: Any, values: Any) -> None:
        cells = [WriteOnlyCell(sheet, value=_value(value)) for value in values]
        for cell in cells:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # never a formula: names may come from strangers
        sheet.append(cells)

    every = (values for values, _ in records(table))
    names = [*_FIRST, *(key for key in keys(table) if key not in NESTED and key not in _FIRST)]
    for number, block in enumerate(table.blocks, 1):
        rows = [next(every) for _ in block.lines]
        used = [name for name in names if any(row[name] not in (None, "") for row in rows)]
        sheet = book.create_sheet(_sheet_name(f"{number} {rows[0]['task']} {rows[0]['protocol']}"))
        sheet.freeze_panes = "A3"
        put(sheet, [f"{block.title}. {block.setting}. {block.origin}"])
        put(sheet, [f"score: {metric_name(rows[0])}" if name == "score" else name for name in used])
        for row in rows:
            put(sheet, [row[name] for name in used])
    sheet = book.create_sheet("notes")
    for text in (*(one for block in table.blocks for one in block.verdict), *table.notes, *table.footer):
        put(sheet, [text])
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def _sheet_name(text: str) -> str:
    """Return a name that Excel takes."""
    return re.sub(r"[^\w .-]+", " ", text)[:_LONGEST_NAME].strip()


def _value(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, int | bool | None) else visible(str(value))[:_LONGEST_TEXT]
