"""A foreign table in memory: where every cell came from is never forgotten."""

from __future__ import annotations

import math
from array import array
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal, InvalidOperation
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.model import Column
from tactbench.core.samples import FloatArray, IntArray

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

    def __len__(self) -> int:
        return len(self.cells)

    def numbers(self, column: Column) -> FloatArray:
        """Return a column, (n,), with NaN where there is no sample; MappingError for what is no number."""
        place = self._place(column)
        values = np.empty(len(self.cells))
        for row, cells in enumerate(self.cells):
            cell = cells[place]
            values[row] = math.nan if cell in self.no_sample else _number(cell)
            if math.isinf(values[row]):
                raise MappingError(
                    f"{self.where(row)}: column {column!r}: {cell!r} is not a number.",
                    hint="If such cells mean 'no sample', list the text under `no_sample` of the table.",
                )
        return values

    def texts(self, column: Column) -> list[str]:
        """Return a column as texts, (n,)."""
        place = self._place(column)
        return [cells[place].strip() for cells in self.cells]

    def nanoseconds(self, column: Column, per_unit: int) -> IntArray:
        """Return a column times `per_unit` as whole nanoseconds, (n,), rounded once; MappingError for a non-time."""
        place = self._place(column)
        times = np.empty(len(self.cells), dtype=np.int64)
        for row, cells in enumerate(self.cells):
            # Seconds since 1970 in float64 are exact to 0.2 µs only: the decimal text knows better.
            try:
                times[row] = _scaled(cells[place].strip(), per_unit)
            except (InvalidOperation, ValueError, OverflowError) as error:
                raise MappingError(
                    f"{self.where(row)}: column {column!r}: {cells[place]!r} is not a time.",
                    hint="A row without a time cannot be kept; check column and unit, or write `clock: none`.",
                ) from error
        return times

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
                    hint="Write `header: false`; and `skip_lines: 1` if that row is none of the data.",
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
            hint = f"{did_you_mean(column, self.header)}It has: {_listing(self.header)}."
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

    def nanoseconds(self, column: Column, per_unit: int) -> IntArray:
        """Return a column times `per_unit` as whole nanoseconds, (n,), rounded once; MappingError for a non-time."""
        values = self._column(column)
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise MappingError(f"{self.where(row)}: column {column}: not a time.", hint="Write `clock: none`.")
        return np.array([_scaled(value, per_unit) for value in values.tolist()], np.int64)

    def take(self, rows: Sequence[int]) -> ArrayTable:
        """Return some of the rows."""
        return ArrayTable(self.shown, self.array[list(rows)])

    def where(self, row: int) -> str:
        """Return file and line of a row, for messages."""
        return f"{self.shown}, row {row}"

    def _column(self, column: Column) -> npt.NDArray[Any]:
        if not isinstance(column, int):
            raise MappingError(f"{self.shown} has no column names.", hint="Give the place, counted from 0.")
        values: npt.NDArray[Any] = self.array[:, _checked(self.shown, column, self.array.shape[1])]
        return values


MESSAGE_TIMES = ("log_time", "publish_time")
"""Columns that every message of a bag has beside its fields: nanoseconds, when it was written and sent."""


@dataclass(frozen=True)
class BagTable:
    """The messages of one topic, a row each, in the order of the bag; of their fields those that were asked for."""

    shown: str
    """Name of file and topic for messages"""
    found: dict[Column, array[float]] = field(default_factory=dict)
    words: dict[Column, list[str]] = field(default_factory=dict)
    stamps: list[Any] = field(default_factory=list)
    """Of the topic's time: whole nanoseconds, or numbers in the mapping's unit"""
    rows: list[int] = field(default_factory=list)
    """Numbers of the messages, from 0"""

    def __len__(self) -> int:
        return len(self.rows)

    def numbers(self, column: Column) -> FloatArray:
        """Return a field, (n,), with NaN where there is no sample; MappingError for an infinite number."""
        return _without_infinities(self, column, np.array(self.found[column], dtype=np.float64))

    def texts(self, column: Column) -> list[str]:
        """Return a field as texts, (n,)."""
        return self.words[column]

    def nanoseconds(self, column: Column, per_unit: int) -> IntArray:
        """Return the topic's time, (n,) nanoseconds; MappingError for a stamp whose unit is said to be another."""
        whole = column in MESSAGE_TIMES or isinstance(self.stamps[0], int)
        if whole and per_unit != 1:
            raise MappingError(f"{self.shown}: {column} is in nanoseconds.", hint="Write `unit: ns` under `time`.")
        if whole:
            return np.array(self.stamps, dtype=np.int64)
        return np.array([_scaled(one, per_unit) for one in self.stamps], dtype=np.int64)

    def take(self, rows: Sequence[int]) -> BagTable:
        """Return some of the rows."""
        return BagTable(
            self.shown,
            {column: array("d", (values[row] for row in rows)) for column, values in self.found.items()},
            {column: [values[row] for row in rows] for column, values in self.words.items()},
            [self.stamps[row] for row in rows] if self.stamps else [],
            [self.rows[row] for row in rows],
        )

    def where(self, row: int) -> str:
        """Return file, topic and message of a row, for messages."""
        return f"{self.shown}, message {self.rows[row]}"


def plain(value: Any) -> str:
    """Return a number as people write it in a mapping: 1, not 1.0."""
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


Table = TextTable | ArrayTable | BagTable
"""Rows and columns of one recording."""


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


def _listing(names: Sequence[str]) -> str:
    shown = ", ".join(names[:MOST_LISTED])
    return f"{shown} … ({len(names)} in all)" if len(names) > MOST_LISTED else shown
