"""The table as a workbook: a sheet a block, numbers as numbers, and a sheet of notes."""

from __future__ import annotations

import io
import math
import re
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.names import metric_name
from tactbench.core.leaderboard.records import NESTED, RANK_KEYS, keys, records
from tactbench.core.leaderboard.table import Table
from tactbench.core.tables.text import visible

_FIRST = (*RANK_KEYS, "sensor", "estimator", "score")
_LONGEST_NAME = 31
"""Characters of a sheet's name that Excel takes."""
_LONGEST_TEXT = 32_767
"""Characters of a cell that Excel takes."""


def xlsx(table: Table) -> bytes:
    """Return a table's records as a workbook; keys without any value in a block and those of lists are left out.

    Raises
    ------
    UsageError
        If openpyxl is not installed.
    """
    try:
        from openpyxl import Workbook
        from openpyxl.cell import WriteOnlyCell
    except ImportError as error:
        raise UsageError(
            f"An Excel file needs openpyxl, which cannot be imported: {error}.",
            hint="Install it with `pip install 'tactbench[xlsx]'`.",
        ) from error
    book = Workbook(write_only=True)

    def put(sheet: Any, values: Any) -> None:
        cells = [WriteOnlyCell(sheet, value=_value(value)) for value in values]
        for cell in cells:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # never a formula: names may come from strangers
        sheet.append(cells)

    every = [values for values, _ in records(table)]
    names = [*_FIRST, *(key for key in keys(table) if key not in NESTED and key not in _FIRST)]
    begin = 0
    for number, block in enumerate(table.blocks, 1):
        rows = every[begin : begin + len(block.lines)]
        begin += len(rows)
        used = [name for name in names if any(row[name] not in (None, "") for row in rows)]
        sheet = book.create_sheet(_sheet_name(block.title, number))
        sheet.freeze_panes = "A3"
        put(sheet, [block.title])
        put(sheet, [f"score: {metric_name(rows[0])}" if name == "score" else name for name in used])
        for row in rows:
            put(sheet, [row[name] for name in used])
    sheet = book.create_sheet("notes")
    for text in (*table.notes, *(f"{section.title}" for section in table.sections), *table.footer):
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
    if isinstance(value, int | bool) or value is None:
        return value
    return visible(str(value))[:_LONGEST_TEXT]
