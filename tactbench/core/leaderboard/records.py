"""A table as records for programs: JSON, CSV, Parquet and an Excel file, with the texts that people see."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from typing import Any

import tactbench
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.table import Table
from tactbench.core.spec.row import FORMAT, JSON_KEYS, NESTED, OF_REPLICATES, RowModel
from tactbench.core.tables import csv_text as csv_format
from tactbench.core.tables.text import json_text, visible

RANK_KEYS = ("rank", "rank_low", "rank_high", "rank_tied")
"""Where a row stands in its block; they follow the keys of the row."""

_FIELDS = list(RowModel.model_fields)
OF_THE_MACHINE = {
    *_FIELDS[_FIELDS.index("sim_s") : _FIELDS.index("simulated")],
    "search", "recordings", "key", "events", "operating_points",
}  # fmt: skip
"""Keys that machine, place or hour decide, not the seed alone."""

FORMAT_VERSION = "1"
_RANKS = {"rank": int, "rank_low": int, "rank_high": int, "rank_tied": bool}


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


def flat_records(table: Table) -> tuple[list[str], list[list[Any]]]:
    """Return names of columns and lines for formats whose cells hold one value: lists and tables are JSON."""
    names = [*keys(table), *RANK_KEYS, *(f"shown_{SHOWN[name]}" for name in table.columns)]
    return names, [[*(_flat(*one) for one in row.items()), *shown.values()] for row, shown in records(table)]


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
        If pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise _lacking("Parquet", "pyarrow", "parquet", error) from error
    types = {bool: pa.bool_(), float: pa.float64(), int: pa.int64(), str: pa.string()}
    names, lines = flat_records(table)
    metadata = {
        "tactbench.format": "tactbench-leaderboard",
        "tactbench.format_version": FORMAT_VERSION,
        "tactbench.version": tactbench.__version__,
        "tactbench.provenance": json_text(list(table.provenance), sort_keys=True),
    }
    schema = pa.schema([(name, types[_kind(name)]) for name in names], metadata=metadata)
    out = io.BytesIO()
    columns = zip(*lines, strict=True) if lines else [()] * len(names)
    pq.write_table(pa.table(list(map(list, columns)), schema=schema), out, compression="zstd")
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
    """Return a table's records as a workbook: numbers as numbers, no formula, and a sheet of what is said of them.

    Raises
    ------
    UsageError
        If openpyxl is not installed.
    """
    try:
        from openpyxl import Workbook
    except ImportError as error:
        raise _lacking("An Excel file", "openpyxl", "xlsx", error) from error
    book = Workbook(write_only=True)
    names, lines = flat_records(table)
    said = [one for block in table.blocks for one in (block.title, block.setting, block.origin, *block.verdict)]
    sheets = {"leaderboard": [names, *lines], "notes": [[one] for one in (*said, *table.notes, *table.footer)]}
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append([_cell(sheet, value) for value in row])
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def _cell(sheet: Any, value: Any) -> Any:
    from openpyxl.cell import WriteOnlyCell

    if isinstance(value, str):
        cell = WriteOnlyCell(sheet, value=visible(value))
        cell.data_type = "s"  # a text that begins with = is no formula
        return cell
    return None if isinstance(value, float) and not math.isfinite(value) else value
