"""The table of texts that all output formats for people render."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tactbench.core.tables.numbers import ABSENT as ABSENT

WORDY = 60
"""Number of characters beyond which a field is wrapped as prose."""


class Entry(str):
    """Text of a table field, with the number for sorting and the name of the cell to link to."""

    __slots__ = ("cell", "value")
    value: float | None
    """Number by which the column is sorted, in one unit for the whole column; None sorts last."""
    cell: str
    """Name of the cell with this result, for a link to the cell's details; empty: no link."""

    def __new__(cls, text: str, value: float | None = None, *, cell: str = "") -> Entry:
        """Return the text with its number and the name of its cell."""
        entry = super().__new__(cls, text)
        entry.value, entry.cell = value, cell
        return entry


@dataclass(frozen=True)
class TextTable:
    """A table of texts: title, columns, lines and notes."""

    title: str
    columns: tuple[str, ...]
    """Names of the columns, from left to right."""
    lines: tuple[tuple[str, ...], ...]
    """Texts of each line, one for each column; some may be of the type `Entry`."""
    numeric: frozenset[str] = frozenset()
    """Names of the columns aligned to the right and sorted by number."""
    headings: tuple[str, ...] = ()
    """Headings of the columns; empty: their names."""
    kinds: tuple[str, ...] = ()
    """Style of each line: ``result``, ``baseline``, ``failed``, ``alarm`` …; empty: plain."""
    origin: str = ""
    """Text to the right of the title: origin of the numbers, such as simulated or measured."""
    summary: tuple[str, ...] = ()
    """Sentences between the title and the lines of the table."""
    notes: tuple[str, ...] = ()
    """Sentences below the lines of the table."""
    first_to_go: tuple[str, ...] = ()
    """Columns to leave out, in this order, on a terminal that is too narrow even with texts broken at spaces."""
    unbroken: frozenset[str] = frozenset()
    """Names of columns whose texts are not broken into lines, so that they can be copied."""

    @property
    def headers(self) -> tuple[str, ...]:
        """Headings of the columns, by default their names."""
        return self.headings or self.columns

    @property
    def right(self) -> tuple[bool, ...]:
        """For each column, True if it is aligned to the right."""
        return tuple(name in self.numeric for name in self.columns)

    @property
    def wordy(self) -> bool:
        """True if a field has more than `WORDY` characters; a narrow screen then shows field below field."""
        return any(len(text) > WORDY for line in self.lines for text in line)

    def compact(self, keep: Collection[str] = ()) -> TextTable:
        """Return the table without columns that are empty in all lines, except for columns in `keep`."""
        kept = [
            place for place, name in enumerate(self.columns)
            if not self.lines or name in keep or any(line[place].strip(ABSENT) for line in self.lines)
        ]  # fmt: skip

        def only(texts: Sequence[str]) -> tuple[str, ...]:
            return tuple(texts[place] for place in kept)

        headings = only(self.headings) if self.headings else ()
        return replace(self, columns=only(self.columns), lines=tuple(map(only, self.lines)), headings=headings)


def sort_value(text: str) -> float | None:
    """Return the number by which a text is sorted: the value of an `Entry`, else the text as a number, or None."""
    if isinstance(text, Entry):
        return text.value
    try:
        return finite(float(text.replace("\u202f", "").replace("−", "-")))
    except ValueError:
        return None


def finite(value: object) -> float | None:
    """Return `value` as a float if it is a finite number, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def text_table(
    title: str,
    columns: Sequence[str],
    lines: Iterable[Sequence[str]],
    *,
    numeric: Collection[str] = (),
    notes: Sequence[str] = (),
    kinds: Sequence[str] = (),
) -> TextTable:
    """Return the table of `lines`, without columns that are empty in all lines."""
    given = tuple(map(tuple, lines))
    return TextTable(title, tuple(columns), given, frozenset(numeric), kinds=tuple(kinds), notes=tuple(notes)).compact()


def records_table(
    title: str, records: Sequence[Mapping[str, Any]], columns: Sequence[str] = (), *, kinds: Sequence[str] = ()
) -> TextTable:
    """Return a table with one line for each record and the keys `columns` (default: all); numbers are aligned right."""
    shown = columns or tuple(dict.fromkeys(name for record in records for name in record))
    lines = [[Entry(field_text(one.get(name)), finite(one.get(name))) for name in shown] for one in records]
    numeric = [name for name in shown if any(finite(one.get(name)) is not None for one in records)]
    return text_table(title, shown, lines, numeric=numeric, kinds=kinds)


def field_text(value: Any) -> str:
    """Return a value, such as a list or mapping, as text for a table field; empty for None."""
    from pydantic import BaseModel

    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return ", ".join(f"{name} = {text}" for name, one in value.items() if (text := field_text(one)))
    if isinstance(value, list | tuple):
        return ", ".join(map(field_text, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}" if isinstance(value, float) else "" if value is None else str(value)
