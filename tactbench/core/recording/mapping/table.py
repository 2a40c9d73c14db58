"""A foreign table in memory, with the place of every row in its file; the reader of text files."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation
from functools import cached_property
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.health import listed
from tactbench.core.recording.mapping.model import Column, Csv, Records, Tabular, Text, Time
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec import units

_DATE = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d{1,9})\d*)?\s*(Z|[+-]\d\d:?\d\d)?")
_GROUPS = re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MARKS = ",.'’ \u00a0\u202f"
"""Marks that separate decimals and groups of thousands in various languages."""
Line = tuple[int, list[str]]
"""The number of a row's line in the file, and the row's cells."""
Used = dict[Column, bool]
"""The columns of a table that a mapping uses; True for readings, False for texts and times (not rounded to float64)."""


@dataclass(frozen=True)
class Table:
    """Rows and columns of one recording: typed columns of an array, a bag or a Parquet file, or texts."""

    shown: str
    """Name of the file for messages, followed by the array or topic from which the table is read."""
    columns: tuple[Column, ...]
    """Names of all columns, or their places if they have no names; for a bag, only the used fields."""
    places: Sequence[int]
    """Place of each row in the file: its line, or its number from 0."""
    values: Mapping[Column, Sequence[Any]]
    """Values of each column that can be read, (n,): an array or a list; texts by place, and by unique name."""
    row: str = ", row "
    """Text between the file and the place of a row in messages."""
    how: Tabular | None = None
    """Notation of the cells of a text file or a sheet; None: the values have types."""

    def __len__(self) -> int:
        return len(self.places)

    def where(self, row: int | np.integer[Any]) -> str:
        """Return the file of a row and the row's place in the file, for messages."""
        return f"{self.shown}{self.row}{self.places[int(row)]}"

    def take(self, rows: Sequence[int]) -> Table:
        """Return a table of the rows with the given numbers, counted from 0."""
        values = {name: [column[row] for row in rows] for name, column in self.values.items()}
        return replace(self, values=values, places=[self.places[row] for row in rows])

    def texts(self, column: Column) -> list[str]:
        """Return the values of a column as texts, one for each row, (n,)."""
        return [plain(value) for value in self._plain(column)]

    def numbers(self, column: Column) -> FloatArray:
        """Return a column, (n,), with NaN where there is no sample; raises MappingError for a cell without a number."""
        values = self._column(column)
        if self.how is not None:  # readings repeat: most columns hold few texts
            number = {text: self._number(text) for text in {*values}}
            values = [number[text] for text in values]
        found = np.asarray(values, dtype=np.float64)
        for row in np.flatnonzero(np.isinf(found)):
            raise self._refusal(row, column, "number")
        return found

    def nanoseconds(self, time: Time) -> IntArray:
        """Return the times of the rows, (n,) [ns], rounded once; raises MappingError for a cell without a time."""
        per_unit, stamps = nanoseconds_per(time), np.empty(len(self), dtype=np.int64)
        for row, value in enumerate(self._plain(time.column)):
            try:
                date = _DATE.fullmatch(value) if isinstance(value, str) else None
                # Seconds since 1970 in float64 are exact to 0.2 µs only; their decimal text is exact.
                number = self._as_python(value) if isinstance(value, str) else value
                stamps[row] = _since_1970(date, time) if date else round(Decimal(number) * per_unit)
            except MappingError as error:
                message = f"{self.where(row)}: column {time.column!r}: {error.message}"
                raise MappingError(message, hint=error.hint) from error
            except (InvalidOperation, ValueError, OverflowError, TypeError) as error:
                raise self._refusal(row, time.column, "time") from error
        return stamps

    def _column(self, column: Column) -> Sequence[Any]:
        if column not in self.values:
            raise no_column(self.shown, column, self.columns)
        name = self.columns[column] if self.how is not None and isinstance(column, int) else None
        if isinstance(name, str) and math.isfinite(self._number(name)):
            raise MappingError(
                f"{self.shown}: its header row has the number {name!r} in column {column}: that looks like a row of "
                "data, which `header: true` would drop.",
                hint="Write `header: false`; and `skiprows: 1` if that row is not data.",
            )
        return self.values[column]

    def _plain(self, column: Column) -> Iterable[Any]:
        values = self._column(column)
        return values.tolist() if isinstance(values, np.ndarray) else values

    @cached_property
    def _no_sample(self) -> frozenset[str]:
        return frozenset(text.strip() for text in self.how.no_sample) if self.how is not None else frozenset()

    def _as_python(self, cell: str) -> str:
        """Return a number as Python writes it; an empty text if its marks are not those of the table."""
        decimal, thousands = (".", None) if self.how is None else (self.how.decimal, self.how.thousands)
        if decimal == "." and thousands is None:
            return cell
        whole, mark, rest = cell.partition(decimal)
        if thousands is not None and thousands in whole:
            first, *groups = whole.lstrip("+-").split(thousands)
            if not 1 <= len(first) <= 3 or any(len(group) != 3 for group in groups):
                return ""
            whole = whole.replace(thousands, "")
        if "." in whole + rest:  # beside a decimal comma: 1700000000.25 is a number, 1.234 may be a thousand and more
            return "" if mark or _GROUPS.fullmatch(whole) else cell
        return f"{whole}{mark and '.'}{rest}"

    def _number(self, text: str) -> float:
        """Return the number in a cell, NaN where the cell stands for no sample, infinity where it is no number."""
        if text in self._no_sample:
            return math.nan
        written = self._as_python(text)
        try:
            return math.inf if "_" in written else float(written)  # float() also reads 1_000, which no table means
        except ValueError:
            return math.inf

    def _refusal(self, row: int | np.integer[Any], column: Column, wanted: str) -> MappingError:
        """Return the error for a cell that is not of the type `wanted` (number or time), with a hint by its cause."""
        text = f"{self.where(row)}: column {column!r}: {self.texts(column)[row]!r} is not a {wanted}."
        hint = "Leave the column out of the mapping." if wanted == "number" else (
            "Times are numbers, or dates like 2024-03-01T12:00:00.25+01:00. A row without a time cannot be kept; check "
            "column and unit, or write `clock: none`."
        )  # fmt: skip
        return MappingError(text, hint=hint if self.how is None else self._cause(int(row), column, wanted) or hint)

    def _cause(self, row: int, column: Column, wanted: str) -> str:
        """Return the next step for a text that cannot be read, by its likely cause; empty if none is likely."""
        cell = self._column(column)[row]
        columns = [self.values[place] for place in range(len(self.columns))]
        if cell in self.columns:
            return "The header is repeated here: cut the file, or remove the line if the rows below belong to it."
        if mark := comment_mark(columns[0][row]):
            return f"This line is a comment: write `comment: {mark!r}` under `read`."
        if row == 0 and not any(math.isfinite(self._number(one[0])) for one in columns):
            return (
                f"No cell of this row is a number (units?): write `skiprows: [{self.places[0] - 1}]` under "
                "`read` (lines count from 0), with the lines left out already."
            )
        marks = [mark for mark in _MARKS if mark in cell and (self.how is None or mark != self.how.decimal)]
        if marks and not cell.strip("+-0123456789eE" + _MARKS):
            mark = json.dumps(marks[0], ensure_ascii=False)
            return (
                f"Under `read`, write `decimal: {mark}` if {mark} begins the decimals, `thousands: {mark}` if it "
                "separates groups of three digits."
            )
        if wanted == "time":
            return ""
        words: dict[str, None] = {}
        for one in columns:  # a column of which most is no number holds names
            odd = [text for text in one if math.isinf(self._number(text))]
            words |= dict.fromkeys(odd if one == self.values[column] or 2 * len(odd) < len(self) else ())
        likely = json.dumps([*words][:12], ensure_ascii=False)
        return f"If all of these mean 'no sample', write `no_sample: {likely}` under `read`."


def no_column(shown: str, column: Column, columns: Sequence[Column]) -> MappingError:
    """Return the error for a column that a table with `columns` does not have, or has several times."""
    names = [name for name in columns if isinstance(name, str)]
    if isinstance(column, str) and (count := names.count(column)) > 1:
        return MappingError(f"{shown} has {count} columns called {column!r}.", hint="Give the column's place instead.")
    near = did_you_mean(str(column), names)
    return MappingError(
        f"{shown} has no column {column!r}.",
        hint=f"{near}Its {len(columns)} columns, with places from 0: {listed([*map(str, columns)], 'columns', 12)}.",
    )


def plain(value: Any) -> str:
    """Return a value as text, whole numbers without decimals as in a mapping file: 1, not 1.0."""
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def comment_mark(cell: str) -> str | None:
    """Return the mark, # or %, if a line that begins with `cell` seems to be a comment; else None."""
    return next((mark for mark in "#%" if cell.lstrip().startswith(mark)), None)


def nanoseconds_per(time: Time) -> int:
    """Return the length of a clock's unit of time [ns]."""
    return round(units.conversion(time.unit, "s") * 1e9)


def _since_1970(date: re.Match[str], time: Time) -> int:
    """Return the nanoseconds since 1970 of an ISO 8601 date; raises MappingError if it is ambiguous."""
    given, fraction, offset = date.groups()
    if time.epoch != "unix":
        raise MappingError(f"{date[0]!r} is a date, not a number.", hint="Write `epoch: unix` under `time`.")
    when = datetime.fromisoformat(given + (offset or ""))
    if offset is None:
        if not time.zone:
            raise MappingError(
                f"{date[0]!r} is a date without a time zone.",
                hint="Write `zone:` under `time`, for example `zone: Europe/Berlin` or `zone: UTC`.",
            )
        when = when.replace(tzinfo=ZoneInfo(time.zone))
        if when.utcoffset() != when.replace(fold=1).utcoffset():  # PEP 495: clocks are set back, or forward
            raise MappingError(
                f"{date[0]!r} occurs twice, or never, in {time.zone}, whose clocks are changed then.",
                hint="Give the times with their offset, 2023-10-29T02:30:00+01:00, or in UTC.",
            )
    return (when - _EPOCH) // timedelta(seconds=1) * 10**9 + int(f"{fraction or '':0<9}")


def read_text(path: Path, shown: str, how: Csv | Text | Records) -> Table:
    """Read a table from a text file; raises MappingError if it is no text, is empty, or has rows of unequal lengths."""
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
            hint="Remove lines with NUL bytes; if all have some, the file is UTF-16: `iconv -f UTF-16 -t UTF-8`.",
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


def table_of(shown: str, lines: list[Line], how: Tabular) -> Table:
    """Return the table made of lines of cells; the first line is the header if `how.header` is true."""
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
    return Table(shown, header or tuple(range(wide)), places, values, ":", how)


def skipped(place: int, how: Tabular) -> bool:
    """Return True if the line at `place`, counted from 0, is to be left out."""
    return place < how.skiprows if isinstance(how.skiprows, int) else place in how.skiprows


def _delimited(lines: Sequence[str], shown: str, how: Csv) -> Iterator[Line]:
    """Yield the number and the cells of each line that is not blank."""
    first = next((line for line in lines if line.strip()), "")
    if first.lower().startswith("sep="):
        hint = f"Write `skiprows: {lines.index(first) + 1}` under `read`, and `delimiter: {first[4:5]!r}`."
        raise MappingError(f"{shown} begins with {first.strip()!r}, a line for Excel.", hint=hint)
    for mark in "\t;":
        if mark in first and how.delimiter not in first:
            raise MappingError(
                f"Cells of {shown} are separated by {json.dumps(mark)}, not by {how.delimiter!r}.",
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
    """Return one row for the lines of each record; raises MappingError for a line with a wrong number of cells."""
    per_row = len(how.numbers_per_line)
    for place, (number, cells) in enumerate(lines):
        wide = how.numbers_per_line[place % per_row]
        if len(cells) != wide:
            raise MappingError(
                f"{shown}:{number}: {len(cells)} numbers on line {place % per_row + 1} of a record, where {wide} are "
                "expected.",
                hint="Repair the record, or correct `numbers_per_line`.",
            )
    if len(lines) % per_row:
        raise MappingError(
            f"{shown}: the file ends after line {len(lines) % per_row} of a record of {per_row} lines.",
            hint="The file was cut short: get it again.",
        )
    starts = range(0, len(lines), per_row)
    return [(lines[at][0], [cell for _, cells in lines[at : at + per_row] for cell in cells]) for at in starts]
