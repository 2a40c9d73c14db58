"""Readers of text files; every error names the file and the line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.model import Csv, Records, Tabular, Text, Written
from tactbench.core.recording.mapping.table import TextTable, comment_mark

_DELIMITERS = {"\t": "tab", ";": "semicolon"}
Line = tuple[int | str, list[str]]
"""The cells of a row, and its line in the file; where lines are channels, the place of its cells in them."""


def read_text(path: Path, shown: str, how: Csv | Text | Records) -> TextTable:
    """Read a text file.

    Raises
    ------
    MappingError
        If the file cannot be read, is empty, or has rows of different lengths.
    """
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, wrong = content[: error.start].count(b"\n") + 1, content[error.start]
        raise MappingError(
            f"{shown}:{line} is not UTF-8 text: byte 0x{wrong:02x}, {bytes([wrong]).decode('latin-1')!r} in Latin-1.",
            hint="If the file is in Latin-1, convert it: `iconv -f LATIN1 -t UTF-8 FILE > NEW`.",
        ) from error
    if "\0" in text:
        raise MappingError(
            f"{shown}:{text.count(chr(10), 0, text.index(chr(0))) + 1} has NUL bytes, as a power cut leaves them.",
            hint="Remove the lines that have some; if all have, the file is UTF-16: `iconv -f UTF-16 -t UTF-8`.",
        )
    if isinstance(how, Records):
        return _records(_lines(text), shown, how)
    return table_of(shown, list(_cells(text, shown, how)), how)


def table_of(shown: str, lines: list[Line], how: Tabular) -> TextTable:
    """Return the table of some lines, of which the first is the header if `how` says so."""
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
        raise MappingError(f"{shown} has no rows.", hint="Remove the file, or correct `header` and `skiprows`.")
    if header and (mark := comment_mark(header[0])) and len(header) < len(lines[0][1]):
        raise MappingError(
            f"{shown}: a comment, {header[0]!r}, stands where the header is expected.",
            hint=f"Write `comment: {mark!r}` under `read`.",
        )
    _same_length(shown, lines, len(header) if header else len(lines[0][1]))
    rows, places = [cells for _, cells in lines], [place for place, _ in lines]
    no_sample = frozenset(text.strip() for text in how.no_sample)
    table = TextTable(shown, header or tuple(range(len(rows[0]))), places, rows, no_sample, trailing)
    return replace(table, decimal=how.decimal, thousands=how.thousands) if isinstance(how, Written) else table


def skipped(place: int, how: Tabular) -> bool:
    """Return whether a line, counted from 0, is left out."""
    return place < how.skiprows if isinstance(how.skiprows, int) else place in how.skiprows


def _trailing(lines: Sequence[Line], how: Tabular) -> bool:
    """Return whether every line of data ends with a delimiter, and so with an empty cell that has no name."""
    data = lines[how.header and not how.transposed :]
    longer = how.transposed or (how.header and bool(data) and len(data[0][1]) == len(lines[0][1]) + 1)
    return longer and bool(data) and all(not cells[-1].strip() for _, cells in data)


def _cells(text: str, shown: str, how: Csv | Text) -> Iterator[Line]:
    """Yield the lines that are not blank, cut into cells."""
    # Lines that are left out stay as blank ones, so that the others keep their numbers.
    lines = ["\n" if skipped(place, how) else line for place, line in enumerate(_lines(text))]
    if how.comment is not None:
        kept = (line.partition(how.comment)[0] for line in lines)
        lines = [line if line.strip() else "\n" for line in kept]
    if isinstance(how, Text):
        for number, line in enumerate(lines, 1):
            if line.strip():
                yield number, line.split()
        return
    first = next((line for line in lines if line.strip()), "")
    if first.lower().startswith("sep="):
        hint = f"Write `skiprows: {lines.index(first) + 1}` under `read`, and `delimiter: {first[4:5]!r}`."
        raise MappingError(f"{shown} begins with {first.strip()!r}, a line for Excel.", hint=hint)
    for mark, name in _DELIMITERS.items():
        if mark in first and how.delimiter not in first:
            raise MappingError(
                f"{shown} is separated by {name}s, and not by {how.delimiter!r}.",
                hint=f"Write delimiter: {json.dumps(mark)} under `read`.",
            )
    reader = csv.reader(lines, delimiter=how.delimiter, strict=True)
    try:
        for cells in reader:
            if cells:
                yield reader.line_num, cells
    except csv.Error as error:
        raise MappingError(
            f"{shown}:{reader.line_num}: {error}.", hint="Check the quotes and the delimiter."
        ) from error


def _lines(text: str) -> list[str]:
    # Not splitlines(): that also breaks at form feeds and Unicode separators, and line numbers would be wrong.
    return io.StringIO(text, newline="").readlines()


def _same_length(shown: str, lines: Sequence[Line], wide: int) -> None:
    for number, cells in lines:
        if len(cells) != wide:
            mark = cells and comment_mark(cells[0])
            raise MappingError(
                f"{shown}:{number}: {len(cells)} cells, where {wide} are expected.",
                hint=f"If this line is a comment, write `comment: {mark!r}` under `read`." if mark else
                "Repair the row, or correct the delimiter; a file cut short ends like this.",
            )  # fmt: skip


def _records(lines: Sequence[str], shown: str, how: Records) -> TextTable:
    first = lines[0].strip() if lines else "nothing"
    if how.first_line not in (None, first):
        raise MappingError(
            f"{shown}:1: {first!r}, where the line {how.first_line!r} is expected.",
            hint="Correct `first_line`, or the pattern of the files.",
        )
    skip = how.first_line is not None
    there = [(number, line.split()) for number, line in enumerate(lines, 1) if number > skip and line.strip()]
    if not there:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file.")
    per_row = len(how.numbers_per_line)
    for place, (number, cells) in enumerate(there):
        wide = how.numbers_per_line[place % per_row]
        if len(cells) != wide:
            raise MappingError(
                f"{shown}:{number}: {len(cells)} numbers on line {place % per_row + 1} of a record, where {wide} are "
                "expected.",
                hint="Repair the record, or correct `numbers_per_line`.",
            )
    if len(there) % per_row:
        raise MappingError(
            f"{shown}:{there[-1][0]}: the file ends after line {len(there) % per_row} of a record of {per_row} lines.",
            hint="The file was cut short: get it again.",
        )
    begins = range(0, len(there), per_row)
    rows = [[cell for _, cells in there[begin : begin + per_row] for cell in cells] for begin in begins]
    places = [there[begin][0] for begin in begins]
    return TextTable(shown, tuple(range(len(rows[0]))), places, rows, how.no_sample)
