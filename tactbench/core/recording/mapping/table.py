"""A foreign table in memory, which knows for every row where it stands in its file."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation
from functools import cached_property
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.health import listed
from tactbench.core.recording.mapping.model import Column, Tabular, Time
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec import units

_DATE = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d{1,9})\d*)?\s*(Z|[+-]\d\d:?\d\d)?")
_GROUPS = re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MARKS = ",.'’ \u00a0\u202f"
"""Marks that separate decimals and thousands in the languages of the world."""
Used = dict[Column, bool]
"""The columns of a table that a mapping uses, and whether each holds readings: a float64 would round times."""


@dataclass(frozen=True)
class Table:
    """Rows and columns of one recording: typed columns of an array, a bag or a Parquet file; :class:`TextTable`."""

    shown: str
    """Name of the file for messages, with the array or the topic that the table is in it."""
    columns: tuple[Column, ...]
    """Names of all columns, or their places where they have no names; of a bag, the fields that are used."""
    places: Sequence[int]
    """Place of each row in the file: its line, or its number from 0."""
    values: Mapping[Column, Sequence[Any]]
    """Values of each column that can be read, (n,): an array or a list."""
    row: str = ", row "
    """Text between the file and the place of a row in messages."""

    def __len__(self) -> int:
        return len(self.places)

    def where(self, row: int | np.integer[Any]) -> str:
        """Return the file of a row and its place in it, for messages."""
        return f"{self.shown}{self.row}{self.places[int(row)]}"

    def take(self, rows: Sequence[int]) -> Table:
        """Return the table of some of the rows."""
        values = {name: [column[row] for row in rows] for name, column in self.values.items()}
        return replace(self, values=values, places=[self.places[row] for row in rows])

    def texts(self, column: Column) -> list[str]:
        """Return a column as texts, (n,)."""
        return [plain(value) for value in self._plain(column)]

    def numbers(self, column: Column) -> FloatArray:
        """Return a column, (n,), with NaN where there is no sample; raises MappingError for a cell without a number."""
        values = self._numbers(column)
        wrong = np.flatnonzero(np.isinf(values))
        if len(wrong):
            raise self._refusal(int(wrong[0]), column, "number")
        return values

    def nanoseconds(self, time: Time) -> IntArray:
        """Return the clock, (n,) whole nanoseconds, rounded once; raises MappingError for a cell without a time."""
        per_unit, stamps = nanoseconds_per(time), np.empty(len(self), dtype=np.int64)
        for row, value in enumerate(self._stamps(time.column)):
            try:
                date = _DATE.fullmatch(value) if isinstance(value, str) else None
                # Seconds since 1970 in float64 are exact to 0.2 µs only; their decimal text is exact.
                stamps[row] = _since_1970(date, time) if date else round(Decimal(value) * per_unit)
            except MappingError as error:
                message = f"{self.where(row)}: column {time.column!r}: {error.message}"
                raise MappingError(message, hint=error.hint) from error
            except (InvalidOperation, ValueError, OverflowError, TypeError) as error:
                raise self._refusal(row, time.column, "time") from error
        return stamps

    def _column(self, column: Column) -> Sequence[Any]:
        if column not in self.values:
            raise no_column(self.shown, column, self.columns)
        return self.values[column]

    def _plain(self, column: Column) -> Iterable[Any]:
        values = self._column(column)
        return values.tolist() if isinstance(values, np.ndarray) else values

    def _stamps(self, column: Column) -> Iterable[Any]:
        """Return a column as dates, or as numbers in the spelling of Python."""
        return self._plain(column)

    def _numbers(self, column: Column) -> FloatArray:
        """Return a column, (n,), with infinity where there is neither a number nor a sign that it is missing."""
        return np.asarray(self._column(column), dtype=np.float64)

    def _refusal(self, row: int, column: Column, wanted: str) -> MappingError:
        """Return the error for a cell that holds no number, or no time."""
        text = f"{self.where(row)}: column {column!r}: {self.texts(column)[row]!r} is not a {wanted}."
        return MappingError(text, hint=self._hint(row, column, wanted))

    def _hint(self, _row: int, _column: Column, wanted: str) -> str:
        if wanted == "number":
            return "Leave the column out."
        return (
            "Times are numbers, or dates like 2024-03-01T12:00:00.25+01:00. A row without a time cannot be kept; check "
            "column and unit, or write `clock: none`."
        )


@dataclass(frozen=True)
class TextTable(Table):
    """Cells as they stand in a text file or a sheet, in columns by place and by names that stand once in the header."""

    row: str = ":"
    how: Tabular = field(kw_only=True)

    @cached_property
    def _no_sample(self) -> frozenset[str]:
        return frozenset(text.strip() for text in self.how.no_sample)

    def _column(self, column: Column) -> Sequence[str]:
        name = self.columns[column] if isinstance(column, int) and column in self.values else None
        if isinstance(name, str) and math.isfinite(self._number(name)):
            raise MappingError(
                f"{self.shown}: its header row has the number {name!r} in column {column}: that looks like a row of "
                "data, which `header: true` would drop.",
                hint="Write `header: false`; and `skiprows: 1` if that row is none of the data.",
            )
        return super()._column(column)

    def _numbers(self, column: Column) -> FloatArray:
        texts = self._column(column)
        number = {text: self._number(text) for text in {*texts}}  # readings repeat: most columns hold few texts
        return np.array([number[text] for text in texts])

    def _stamps(self, column: Column) -> Iterable[str]:
        return (text if ":" in text else self._as_python(text) for text in self._column(column))

    def _as_python(self, cell: str) -> str:
        """Return a number as Python writes it; an empty text if the cell is written in another way than the table."""
        decimal, thousands = self.how.decimal, self.how.thousands
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

    def _hint(self, row: int, column: Column, wanted: str) -> str:
        """Return the next step, by what the row or the spelling of the cell says of the cause."""
        cell = self._column(column)[row]
        columns = [self.values[place] for place in range(len(self.columns))]
        if cell in self.columns:
            return "The header stands here again: cut the file there, or remove the line if rows below it belong to it."
        if mark := comment_mark(columns[0][row]):
            return f"This line is a comment: write `comment: {mark!r}` under `read`."
        if row == 0 and not any(math.isfinite(self._number(one[0])) for one in columns):
            return (
                f"No cell of this row is one, as in a row of units: write `skiprows: [{self.places[0] - 1}]` under "
                "`read` (lines count from 0), with those left out already."
            )
        marks = [mark for mark in _MARKS if mark in cell and mark != self.how.decimal]
        if marks and not cell.strip("+-0123456789eE" + _MARKS):
            mark = json.dumps(marks[0], ensure_ascii=False)
            return (
                f"Under `read`, write `decimal: {mark}` if {mark} begins the decimals, `thousands: {mark}` if it "
                "separates groups of three digits."
            )
        if wanted == "time":
            return super()._hint(row, column, wanted)
        words: dict[str, None] = {}
        for one in columns:  # a column of which most is no number holds names
            odd = [text for text in one if math.isinf(self._number(text))]
            words |= dict.fromkeys(odd if one == self.values[column] or 2 * len(odd) < len(self) else ())
        likely = json.dumps([*words][:12], ensure_ascii=False)
        return f"If all mean 'no sample', write `no_sample: {likely}` under `read`."


def no_column(shown: str, column: Column, columns: Sequence[Column]) -> MappingError:
    """Return the error for a column that a table with `columns` does not have, or has several times."""
    names = [name for name in columns if isinstance(name, str)]
    if isinstance(column, str) and (count := names.count(column)) > 1:
        return MappingError(f"{shown} has {count} columns called {column!r}.", hint="Give its place.")
    near = did_you_mean(str(column), names)
    return MappingError(
        f"{shown} has no column {column!r}.",
        hint=f"{near}It has {len(columns)}, with places from 0: {listed([*map(str, columns)], 'columns', 12)}.",
    )


def plain(value: Any) -> str:
    """Return a number as people write it in a mapping: 1, not 1.0."""
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def comment_mark(cell: str) -> str | None:
    """Return the mark that a comment seems to begin with, if a line that begins with `cell` looks like one."""
    return next((mark for mark in "#%" if cell.lstrip().startswith(mark)), None)


def nanoseconds_per(time: Time) -> int:
    """Return how many nanoseconds the unit of a clock has."""
    return round(units.conversion(time.unit, "s") * 1e9)


def _since_1970(date: re.Match[str], time: Time) -> int:
    """Return the nanoseconds since 1970 of an ISO 8601 date; raises MappingError where it is not one moment."""
    given, fraction, offset = date.groups()
    if time.epoch != "unix":
        raise MappingError(f"{date[0]!r} is a date.", hint="Write `epoch: unix` under `time`.")
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
                f"{date[0]!r} is no moment, or two, in {time.zone}, whose clocks are changed then.",
                hint="Give the times with their offset, 2023-10-29T02:30:00+01:00, or in UTC.",
            )
    return (when - _EPOCH) // timedelta(seconds=1) * 10**9 + int(f"{fraction or '':0<9}")
