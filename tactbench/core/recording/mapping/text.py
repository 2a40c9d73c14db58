"""Reading text files into tables: every complaint names the file and the line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.model import Csv, Records, Tabular, Text
from tactbench.core.recording.mapping.table import TextTable

_DELIMITERS = {"\t": "tab", ";": "semicolon"}
Line = tuple[int | str, list[str]]
"""Number of a line, or of a cell in each where the lines are channels, and its cells."""


def read_text(path: Path, shown: str, how: Csv | Text | Records) -> TextTable:
    """Read a text file.

    Raises
    ------
    MappingError
        If the file cannot be read, is empty, or has rows of different lengths.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MappingError(f"{shown} cannot be read: {error.strerror}.", hint="Check its permissions.") from error
    except UnicodeDecodeError as error:
        raise MappingError(
            f"{shown} is not UTF-8 text.",
            hint="Name what it is, `format: xlsx`, `npz` or `mat`, or save the table as CSV in UTF-8.",
        ) from error
    if isinstance(how, Records):
        return _records(_lines(text), shown, how)
    return table_of(shown, list(_cells(text, shown, how)), how)


def table_of(shown: str, lines: list[Line], how: Tabular) -> TextTable:
    """Return the table that lines make, the first of them its header if `how` says so."""
    header, trailing = None, _trailing(lines, how)
    if trailing:
        for _, cells in lines[how.header and not how.transposed :]:
            cells.pop()
    if how.transposed and lines:
        _same_length(shown, lines, len(lines[0][1]))
        turned = zip(*(cells for _, cells in lines), strict=True)
        lines = [(f"cell {number}", list(cells)) for number, cells in enumerate(turned, 1)]
    if how.header and lines:
        header = tuple(cell.strip() for cell in lines.pop(0)[1])
    if not lines:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file, or correct `header` and `skip_lines`.")
    _same_length(shown, lines, len(header) if header else len(lines[0][1]))
    rows, places = [cells for _, cells in lines], [place for place, _ in lines]
    return TextTable(shown, header, rows, places, how.no_sample, trailing)


def _trailing(lines: Sequence[Line], how: Tabular) -> bool:
    """Tell whether a delimiter ends every line of data, so that an empty cell stands where nothing has a name."""
    data = lines[how.header and not how.transposed :]
    longer = how.transposed or (how.header and bool(data) and len(data[0][1]) == len(lines[0][1]) + 1)
    return longer and bool(data) and all(not cells[-1].strip() for _, cells in data)


def _cells(text: str, shown: str, how: Csv | Text) -> Iterator[Line]:
    """Yield the lines that are not blank."""
    lines = _lines(text)[how.skip_lines :]
    if isinstance(how, Text):
        for number, line in enumerate(lines, how.skip_lines + 1):
            if line.strip():
                yield number, line.split()
        return
    for mark, name in _DELIMITERS.items():
        if lines and mark in lines[0] and how.delimiter not in lines[0]:
            raise MappingError(
                f"{shown} is separated by {name}s, and not by {how.delimiter!r}.",
                hint=f"Write delimiter: {json.dumps(mark)} under `read`.",
            )
    reader = csv.reader(lines, delimiter=how.delimiter, strict=True)
    try:
        for cells in reader:
            if cells:
                yield reader.line_num + how.skip_lines, cells
    except csv.Error as error:
        raise MappingError(
            f"{shown}:{reader.line_num + how.skip_lines}: {error}.", hint="Check the quotes and the delimiter."
        ) from error


def _lines(text: str) -> list[str]:
    # Not splitlines(): that also breaks at form feeds and Unicode separators, and line numbers would be wrong.
    return io.StringIO(text, newline="").readlines()


def _same_length(shown: str, lines: Sequence[Line], wide: int) -> None:
    for number, cells in lines:
        if len(cells) != wide:
            raise MappingError(
                f"{shown}:{number}: {len(cells)} cells, where {wide} are expected.",
                hint="Repair the row, or correct the delimiter; a file cut short ends like this.",
            )


def _records(lines: Sequence[str], shown: str, how: Records) -> TextTable:
    first = 0
    if how.first_line is not None:
        if not lines or lines[0].strip() != how.first_line:
            given = lines[0].strip() if lines else "nothing"
            raise MappingError(
                f"{shown}:1: {given!r}, where the line {how.first_line!r} is expected.",
                hint="Is it the file the mapping means?",
            )
        first = 1
    there = [(number, line.split()) for number, line in enumerate(lines[first:], first + 1) if line.strip()]
    if not there:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file.")
    per_row = len(how.numbers_per_line)
    rows: list[list[str]] = []
    begins: list[int] = []
    for place, (number, cells) in enumerate(there):
        line = place % per_row
        if len(cells) != how.numbers_per_line[line]:
            raise MappingError(
                f"{shown}:{number}: {len(cells)} numbers on line {line + 1} of a record, where "
                f"{how.numbers_per_line[line]} are expected.",
                hint="Repair the record, or correct `numbers_per_line`.",
            )
        if line == 0:
            rows.append([])
            begins.append(number)
        rows[-1].extend(cells)
    if len(there) % per_row:
        raise MappingError(
            f"{shown}:{there[-1][0]}: the file ends after line {len(there) % per_row} of a record of {per_row} lines.",
            hint="The file was cut short: get it again.",
        )
    return TextTable(shown, None, rows, begins, how.no_sample)
