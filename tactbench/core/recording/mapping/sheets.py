"""Reader of Excel workbooks; formulas are not computed: the values that Excel has stored with them are read."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from datetime import date, time
from pathlib import Path
from typing import Any

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.model import Xlsx
from tactbench.core.recording.mapping.table import TextTable, plain
from tactbench.core.recording.mapping.text import Line, skipped, table_of


def read_sheet(path: Path, shown: str, how: Xlsx) -> TextTable:
    """Return the table in one sheet of a workbook.

    Raises
    ------
    MappingError
        If openpyxl is not installed, the file is no workbook, the sheet is not in it, or it is empty.
    """
    try:
        from openpyxl import load_workbook
    except ImportError as error:
        raise MappingError(
            f"{shown} is an Excel workbook, which needs openpyxl: {error}.",
            hint="Install it with `pip install 'tactbench[xlsx]'`, or save the sheet as CSV.",
        ) from error
    try:
        with warnings.catch_warnings(), path.open("rb") as opened:
            warnings.simplefilter("ignore")  # styles and extensions that openpyxl does not know
            book = load_workbook(opened, read_only=True, data_only=True)
            sheet = _sheet(book, shown, how)
            lines = list(_lines(sheet.iter_rows(values_only=True), how))
    except MappingError:
        raise
    except Exception as error:  # whatever a damaged file makes of the library
        raise MappingError(
            f"{shown} cannot be read as an Excel workbook: {error}.", hint="Open it and save the sheet as CSV."
        ) from error
    wide = len(lines[0][1]) if lines else 0
    return table_of(shown, [(number, cells + [""] * (wide - len(cells))) for number, cells in lines], how)


def _sheet(book: Any, shown: str, how: Xlsx) -> Any:
    names = book.sheetnames
    name = names[0] if how.sheet is None and len(names) == 1 else how.sheet
    if name not in names:
        what = "several sheets" if name is None else f"no sheet {name!r}"
        raise MappingError(f"{shown} has {what}.", hint=f"Write `sheet:` with one of: {', '.join(names)}.")
    return book[name]


def _lines(rows: Any, how: Xlsx) -> Iterator[Line]:
    """Yield the rows that are neither blank nor left out, each without the blank cells at its end."""
    for number, row in enumerate(rows, 1):
        cells = [] if skipped(number - 1, how) else [_text(value) for value in row]
        while cells and not cells[-1]:
            cells.pop()
        if cells:
            yield number, cells


def _text(value: Any) -> str:
    if value is None:
        return ""
    return value.isoformat() if isinstance(value, date | time) else plain(value)
