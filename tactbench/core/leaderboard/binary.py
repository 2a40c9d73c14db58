"""The table as Parquet, and as an Excel file: typed columns, and a sheet a block."""

from __future__ import annotations

import io
import math
import re
from typing import Any

import tactbench
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.names import metric_name
from tactbench.core.leaderboard.records import NESTED, RANK_KEYS, flat_records, keys, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.spec.row import FORMAT
from tactbench.core.tables.text import json_text, visible

FORMAT_VERSION = "1"
_RANKS = {"rank": int, "rank_low": int, "rank_high": int, "rank_tied": bool}
_FIRST = (*RANK_KEYS, "sensor", "estimator", "score")
_LONGEST_NAME, _LONGEST_TEXT = 31, 32_767
"""Characters that Excel takes in a sheet's name and in a cell."""


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
        sheet = book.create_sheet(_sheet_name(block.title, number))
        sheet.freeze_panes = "A3"
        put(sheet, [block.title])
        put(sheet, [f"score: {metric_name(rows[0])}" if name == "score" else name for name in used])
        for row in rows:
            put(sheet, [row[name] for name in used])
    sheet = book.create_sheet("notes")
    for text in (*table.notes, *(section.title for section in table.sections), *table.footer):
        put(sheet, [text])
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def _sheet_name(title: str, number: int) -> str:
    """Return a name that Excel takes: the block's number, task and protocol."""
    parts = title.split(" · ")
    name = re.sub(r"[^\w .-]+", " ", " ".join((str(number), parts[0], *parts[2:3])))
    return name[:_LONGEST_NAME].strip()


def _value(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, int | bool | None) else visible(str(value))[:_LONGEST_TEXT]
