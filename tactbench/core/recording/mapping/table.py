"""A foreign table in memory: where every cell came from is never forgotten."""

from __future__ import annotations

import json
import math
import re
from array import array
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.model import Column, Time
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec import units

MOST_LISTED = 12
"""Columns named in a message."""


@dataclass(frozen=True)
class TextTable:
    """Cells as they stand in a text file."""

    shown: str
    """Name of the file for messages."""
    header: tuple[str, ...] | None
    cells: list[list[str]]
    lines: Sequence[int | str]
    """Line of the file on which each row begins."""
    no_sample: Collection[str] = field(default=())
    trailing: bool = False
    """Whether the lines of data ended with a delimiter that the header had not."""

    decimal: str = "."
    thousands: str | None = None

    def __len__(self) -> int:
        return len(self.cells)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Names of its columns, or their places where there is no header."""
        return self.header or tuple(range(len(self.cells[0])))

    def numbers(self, column: Column) -> FloatArray:
        """Return a column, (n,), with NaN where there is no sample; MappingError for what is no number."""
        place = self._place(column)
        values = np.array([self._value(cells[place]) for cells in self.cells])
        wrong = np.flatnonzero(np.isinf(values))
        if len(wrong):
            raise self._misfit(int(wrong[0]), column, place, "number") or self._words(int(wrong[0]), column, place)
        return values

    def texts(self, column: Column) -> list[str]:
        """Return a column as texts, (n,)."""
        place = self._place(column)
        return [cells[place].strip() for cells in self.cells]

    def nanoseconds(self, time: Time) -> IntArray:
        """Return the clock, (n,) whole nanoseconds, rounded once; MappingError for a non-time."""
        place, per_unit = self._place(time.column), nanoseconds_per(time)
        times = np.empty(len(self.cells), dtype=np.int64)
        for row, cells in enumerate(self.cells):
            text = cells[place].strip()
            # Seconds since 1970 in float64 are exact to 0.2 µs only: the decimal text knows better.
            try:
                date = _DATE.fullmatch(text)
                times[row] = _since_1970(date, time) if date else _scaled(self._as_python(text), per_unit)
            except MappingError as error:
                message = f"{self.where(row)}: column {time.column!r}: {error.message}"
                raise MappingError(message, hint=error.hint) from error
            except (InvalidOperation, ValueError, OverflowError) as error:
                raise self._misfit(row, time.column, place, "time") or MappingError(
                    f"{self.where(row)}: column {time.column!r}: {cells[place]!r} is not a time.",
                    hint="Times are numbers, or dates like 2024-03-01T12:00:00.25+01:00. A row without a time cannot "
                    "be kept; check column and unit, or write `clock: none`.",
                ) from error
        return times

    def _as_python(self, cell: str) -> str:
        """Return a number as Python writes it; an empty text if the cell is written in another way than the table."""
        whole, mark, rest = cell.partition(self.decimal)
        if self.thousands is not None and self.thousands in whole:
            first, *groups = whole.lstrip("+-").split(self.thousands)
            if not 1 <= len(first) <= 3 or any(len(group) != 3 for group in groups):
                return ""
            whole = whole.replace(self.thousands, "")
        if "." in whole + rest:  # beside a decimal comma: 1700000000.25 is a number, 1.234 may be a thousand and more
            return "" if mark or _GROUPS.fullmatch(whole) else cell
        return f"{whole}{mark and '.'}{rest}"

    def _value(self, cell: str) -> float:
        """Return the number in a cell, NaN for no sample; infinity: there is none."""
        text = cell.strip()
        return math.nan if text in self.no_sample else _number(self._as_python(text))

    def _misfit(self, row: int, column: Column, place: int, wanted: str) -> MappingError | None:
        """Return the error for a cell whose row or spelling says what is wrong with it."""
        cells, cell = self.cells[row], self.cells[row][place].strip()
        said = f"{self.where(row)}: column {column!r}: {cell!r} is not a {wanted}"
        if self.header and cell == self.header[place]:
            return MappingError(
                f"{said}: the header stands here again, as where a logger was started again.",
                hint="Cut the file there, or remove the line if the rows below it belong to the same recording.",
            )
        if mark := comment_mark(cells[0]):
            return MappingError(f"{said}: this line is a comment.", hint=f"Write `comment: {mark!r}` under `read`.")
        line = self.lines[row]
        if row == 0 and isinstance(line, int) and not any(math.isfinite(self._value(one)) for one in cells):
            return MappingError(
                f"{said}; no cell of this row is, as in a row of units.",
                hint=f"Write `skiprows: [{line - 1}]` under `read` (lines count from 0), with those left out already.",
            )
        marks = [mark for mark in _MARKS if mark in cell and mark != self.decimal]
        if marks and not cell.strip("+-0123456789eE" + _MARKS):
            mark = json.dumps(marks[0], ensure_ascii=False)
            return MappingError(
                f"{said}.",
                hint=f"Under `read`, write `decimal: {mark}` if {mark} begins the decimals, `thousands: {mark}`"
                " if it separates groups of three digits.",
            )
        return None

    def _words(self, row: int, column: Column, place: int) -> MappingError:
        """Return the error for a cell that is no number, with all such cells of columns that are mostly numbers."""
        words: Counter[str] = Counter()
        for one in range(len(self.cells[row])):
            odd = [text for cells in self.cells if math.isinf(self._value(text := cells[one].strip()))]
            words.update(odd if one == place or 2 * len(odd) < len(self) else ())
        listed = [word for word, _ in words.most_common(MOST_LISTED)]
        return MappingError(
            f"{self.where(row)}: column {column!r}: {self.cells[row][place]!r} is not a number. In columns of numbers "
            f"stand {names_listed([f'{word!r} ({count})' for word, count in words.most_common()])}.",
            hint=f"If all mean 'no sample', write `no_sample: {json.dumps(listed, ensure_ascii=False)}` under `read`.",
        )

    def take(self, rows: Sequence[int]) -> TextTable:
        """Return some of the rows."""
        return replace(self, cells=[self.cells[row] for row in rows], lines=[self.lines[row] for row in rows])

    def where(self, row: int) -> str:
        """Return file and line of a row, for messages."""
        return f"{self.shown}:{self.lines[row]}"

    def _place(self, column: Column) -> int:
        if isinstance(column, int):
            wide = len(self.cells[0]) if self.cells else len(self.header or ())
            place = _checked(self.shown, column, wide)
            if self.header is not None and math.isfinite(_number(self.header[place])):
                raise MappingError(
                    f"{self.shown}: its header row has the number {self.header[place]!r} in column {column}: that looks"
                    " like a row of data, which `header: true` would drop.",
                    hint="Write `header: false`; and `skiprows: 1` if that row is none of the data.",
                )
            return place
        if self.header is None:
            raise MappingError(
                f"{self.shown} has no header row, so there is no column {column!r}.",
                hint="Give its place, counted from 0, or set `header: true`.",
            )
        if self.header.count(column) > 1:
            raise MappingError(
                f"{self.shown} has {self.header.count(column)} columns called {column!r}.", hint="Give its place."
            )
        if column not in self.header:
            hint = f"{did_you_mean(column, self.header)}It has: {names_listed(self.header)}."
            raise MappingError(f"{self.shown} has no column {column!r}.", hint=hint)
        return self.header.index(column)


@dataclass(frozen=True)
class ArrayTable:
    """Rows of an array."""

    shown: str
    """Name of file and array for messages."""
    array: npt.NDArray[Any]
    """(n, channels)"""

    def __len__(self) -> int:
        return len(self.array)

    def numbers(self, column: Column) -> FloatArray:
        """Return a column, (n,), with NaN where there is no sample; MappingError for what is no number."""
        return _without_infinities(self, column, self._column(column).astype(np.float64))

    def texts(self, column: Column) -> list[str]:
        """Return a column as texts, (n,)."""
        return [plain(value) for value in self._column(column).tolist()]

    def nanoseconds(self, time: Time) -> IntArray:
        """Return the clock, (n,) whole nanoseconds, rounded once; MappingError for a non-time."""
        return _array_times(self, self._column(time.column).tolist(), time)

    def take(self, rows: Sequence[int]) -> ArrayTable:
        """Return some of the rows."""
        return ArrayTable(self.shown, self.array[list(rows)])

    def where(self, row: int) -> str:
        """Return file and line of a row, for messages."""
        return f"{self.shown}, row {row}"

    @property
    def columns(self) -> tuple[Column, ...]:
        """Places of its columns."""
        return tuple(range(self.array.shape[1]))

    def _column(self, column: Column) -> npt.NDArray[Any]:
        if not isinstance(column, int):
            raise MappingError(f"{self.shown} has no column names.", hint="Give the place, counted from 0.")
        values: npt.NDArray[Any] = self.array[:, _checked(self.shown, column, self.array.shape[1])]
        return values


MESSAGE_TIMES = ("log_time", "publish_time")
"""Columns that every message of a bag has beside its fields: nanoseconds, when it was written and sent."""


@dataclass(frozen=True)
class ColumnTable:
    """Those columns that the mapping uses: fields of the messages of one topic, or columns of a Parquet file."""

    shown: str
    """Name of the file, and the topic, for messages"""
    found: dict[Column, array[float]] = field(default_factory=dict)
    words: dict[Column, list[str]] = field(default_factory=dict)
    stamps: list[Any] = field(default_factory=list)
    """Of the topic's time: whole nanoseconds, or numbers in the mapping's unit"""
    rows: list[int] = field(default_factory=list)
    """Numbers of the rows in the file, from 0"""
    columns: tuple[Column, ...] = ()
    """All columns of the file; of a bag none, whose other fields are not looked at"""
    row: str = "message"
    """What a row is"""

    def __len__(self) -> int:
        return len(self.rows)

    def numbers(self, column: Column) -> FloatArray:
        """Return a field, (n,), with NaN where there is no sample; MappingError for an infinite number."""
        return _without_infinities(self, column, np.array(self.found[column], dtype=np.float64))

    def texts(self, column: Column) -> list[str]:
        """Return a field as texts, (n,)."""
        return self.words[column]

    def nanoseconds(self, time: Time) -> IntArray:
        """Return the topic's time, (n,) nanoseconds; MappingError for a stamp whose unit is said to be another."""
        if not isinstance(self.stamps[0], int):
            return _array_times(self, self.stamps, time)
        if nanoseconds_per(time) != 1:
            raise MappingError(f"{self.shown}: {time.column} is in nanoseconds.", hint="Write `unit: ns` under `time`.")
        return np.array(self.stamps, dtype=np.int64)

    def take(self, rows: Sequence[int]) -> ColumnTable:
        """Return some of the rows."""
        return ColumnTable(
            self.shown,
            {column: array("d", (values[row] for row in rows)) for column, values in self.found.items()},
            {column: [values[row] for row in rows] for column, values in self.words.items()},
            [self.stamps[row] for row in rows] if self.stamps else [],
            [self.rows[row] for row in rows],
            self.columns,
            self.row,
        )

    def where(self, row: int) -> str:
        """Return file, topic and number of a row, for messages."""
        return f"{self.shown}, {self.row} {self.rows[row]}"


def plain(value: Any) -> str:
    """Return a number as people write it in a mapping: 1, not 1.0."""
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


Table = TextTable | ArrayTable | ColumnTable
"""Rows and columns of one recording."""

_DATE = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(?:[.,](\d{1,9})\d*)?\s*(Z|[+-]\d\d:?\d\d)?")
_GROUPS = re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MARKS = ",.'’ \u00a0\u202f"
"""What separates decimals and thousands in the world."""


def comment_mark(cell: str) -> str | None:
    """Return what a comment seems to begin with, if a line that begins with `cell` looks like one."""
    return next((mark for mark in "#%" if cell.lstrip().startswith(mark)), None)


def nanoseconds_per(time: Time) -> int:
    """Return how many nanoseconds the unit of a clock has."""
    return round(units.conversion(time.unit, "s") * 1e9)


def _since_1970(date: re.Match[str], time: Time) -> int:
    """Return the nanoseconds since 1970 of an ISO 8601 date; MappingError where it is not one moment."""
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


def _array_times(table: Table, values: Sequence[Any], time: Time) -> IntArray:
    per_unit, times = nanoseconds_per(time), np.empty(len(values), dtype=np.int64)
    for row, value in enumerate(values):
        try:
            date = _DATE.fullmatch(value) if isinstance(value, str) else None
            times[row] = _since_1970(date, time) if date else _scaled(value, per_unit)
        except MappingError as error:
            raise MappingError(f"{table.where(row)}: column {time.column}: {error.message}", hint=error.hint) from error
        except (InvalidOperation, ValueError, OverflowError, TypeError) as error:
            message = f"{table.where(row)}: column {time.column}: {value!r} is not a time."
            raise MappingError(message, hint="Correct the column, or write `clock: none`.") from error
    return times


def _scaled(value: Any, per_unit: int) -> int:
    return int((Decimal(value) * per_unit).to_integral_value())


def _without_infinities(table: Table, column: Column, values: FloatArray) -> FloatArray:
    wrong = np.flatnonzero(np.isinf(values))
    if len(wrong):
        raise MappingError(f"{table.where(int(wrong[0]))}: column {column}: infinite.", hint="Leave the column out.")
    return values


def _number(cell: str) -> float:
    """Return the number in a cell; infinity: there is none."""
    try:
        # Python's float() also reads 1_000; no table in the world means that.
        return math.inf if "_" in cell else float(cell)
    except ValueError:
        return math.inf


def _checked(shown: str, place: int, wide: int) -> int:
    if not 0 <= place < wide:
        raise MappingError(
            f"{shown} has no column {place}: it has {wide}, numbered from 0 to {wide - 1}.", hint="Correct the place."
        )
    return place


def names_listed(names: Sequence[str]) -> str:
    """Return the first names, and how many there are if these are not all."""
    shown = ", ".join(names[:MOST_LISTED])
    return f"{shown} … ({len(names)} in all)" if len(names) > MOST_LISTED else shown
