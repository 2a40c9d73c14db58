"""Readers of text files; every error names the file and the line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.model import Column, Csv, Records, Tabular, Text
from tactbench.core.recording.mapping.table import TextTable, comment_mark

Line = tuple[int, list[str]]
"""The cells of a row, and its line in the file."""


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
    # Not splitlines(): that also breaks at form feeds and Unicode separators, and line numbers would be wrong. Lines
    # that are left out stay as blank ones, so that the others keep their numbers.
    lines = [
        "\n" if skipped(place, how) else line for place, line in enumerate(io.StringIO(text, newline="").readlines())
    ]
    if how.comment is not None:
        kept = (line.partition(how.comment)[0] for line in lines)
        lines = [line if line.strip() else "\n" for line in kept]
    if isinstance(how, Csv):
        return table_of(shown, list(_delimited(lines, shown, how)), how)
    cells = [(number, line.split()) for number, line in enumerate(lines, 1) if line.strip()]
    return table_of(shown, _joined(cells, shown, how) if isinstance(how, Records) else cells, how)


def table_of(shown: str, lines: list[Line], how: Tabular) -> TextTable:
    """Return the table of some lines, of which the first is the header if `how` says so."""
    header = tuple(cell.strip() for cell in lines.pop(0)[1]) if how.header and lines else ()
    if not lines:
        raise MappingError(f"{shown} has no rows.", hint="Remove the file, or correct `header` and `skiprows`.")
    wide = len(header or lines[0][1])
    mark = comment_mark(header[0]) if header else None
    if mark and wide < len(lines[0][1]):
        raise MappingError(
            f"{shown}: a comment, {header[0]!r}, stands where the header is expected.",
            hint=f"Write `comment: {mark!r}` under `read`.",
        )
    trailing = bool(header) and all(len(cells) == wide + 1 and not cells[-1].strip() for _, cells in lines)
    for number, cells in lines:
        if len(cells) != wide + trailing:
            mark = comment_mark(cells[0])
            raise MappingError(
                f"{shown}:{number}: {len(cells)} cells, where {wide} are expected.",
                hint=f"If this line is a comment, write `comment: {mark!r}` under `read`." if mark else
                "Repair the row, or correct the delimiter; a file cut short ends like this.",
            )  # fmt: skip
    turned = zip(*(cells for _, cells in lines), strict=True)
    columns = [[cell.strip() for cell in column] for column in turned][:wide]
    names: dict[Column, list[str]] = {
        name: column for name, column in zip(header, columns, strict=False) if header.count(name) == 1
    }
    places = [number for number, _ in lines]
    values = names | dict(enumerate(columns))
    return TextTable(shown, header or tuple(range(wide)), places, values, how=how)


def skipped(place: int, how: Tabular) -> bool:
    """Return whether a line, counted from 0, is left out."""
    return place < how.skiprows if isinstance(how.skiprows, int) else place in how.skiprows


def _delimited(lines: Sequence[str], shown: str, how: Csv) -> Iterator[Line]:
    """Yield the lines that are not blank, cut into cells."""
    first = next((line for line in lines if line.strip()), "")
    if first.lower().startswith("sep="):
        hint = f"Write `skiprows: {lines.index(first) + 1}` under `read`, and `delimiter: {first[4:5]!r}`."
        raise MappingError(f"{shown} begins with {first.strip()!r}, a line for Excel.", hint=hint)
    for mark in "\t;":
        if mark in first and how.delimiter not in first:
            raise MappingError(
                f"{shown} is separated by {json.dumps(mark)}, and not by {how.delimiter!r}.",
                hint=f"Write `delimiter: {json.dumps(mark)}` under `read`.",
            )
    reader = csv.reader(lines, delimiter=how.delimiter, strict=True)
    try:
        yield from ((reader.line_num, cells) for cells in reader if cells)
    except csv.Error as error:
        raise MappingError(
            f"{shown}:{reader.line_num}: {error}.", hint="Check the quotes and the delimiter."
        ) from error


def _joined(lines: Sequence[Line], shown: str, how: Records) -> list[Line]:
    """Return a row for the lines of each record; raises MappingError for a line of another length."""
    per_row = len(how.numbers_per_line)
    rows: list[Line] = []
    for place, (number, cells) in enumerate(lines):
        line, wide = place % per_row, how.numbers_per_line[place % per_row]
        if len(cells) != wide:
            raise MappingError(
                f"{shown}:{number}: {len(cells)} numbers on line {line + 1} of a record, where {wide} are expected.",
                hint="Repair the record, or correct `numbers_per_line`.",
            )
        if line:
            rows[-1][1].extend(cells)
        else:
            rows.append((number, cells))
    if len(lines) % per_row:
        raise MappingError(
            f"{shown}: the file ends after line {len(lines) % per_row} of a record of {per_row} lines.",
            hint="The file was cut short: get it again.",
        )
    return rows
