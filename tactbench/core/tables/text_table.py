"""The table of text that every format for people renders."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tactbench.core.tables.numbers import ABSENT as ABSENT

WORDY = 60
"""A field of more characters wraps as prose."""


class Entry(str):
    """A text of a table with the number behind it and a link."""

    __slots__ = ("cell", "value")
    value: float | None
    """Number that a column is sorted by, in one unit for the whole column; None sorts last."""
    cell: str
    """The cell that it is from, by name; a page that has a place for each cell makes a link of it."""

    def __new__(cls, text: str, value: float | None = None, *, cell: str = "") -> Entry:
        """Return the text with its number and its cell."""
        entry = super().__new__(cls, text)
        entry.value, entry.cell = value, cell
        return entry


@dataclass(frozen=True)
class TextTable:
    """A title, columns, lines and notes."""

    title: str
    columns: tuple[str, ...]
    """Names of the columns."""
    lines: tuple[tuple[str, ...], ...]
    """One text a column; some may be `Entry`."""
    numeric: frozenset[str] = frozenset()
    """Columns aligned to the right and sorted by value."""
    headings: tuple[str, ...] = ()
    """Headings of the columns, if they are not their names."""
    kinds: tuple[str, ...] = ()
    """One word a line, by which it looks other than plain: ``result``, ``baseline``, ``failed``, ``alarm`` …"""
    origin: str = ""
    """Where the numbers come from, to the right of the title: simulated or measured."""
    summary: tuple[str, ...] = ()
    """Sentences below the title."""
    notes: tuple[str, ...] = ()
    """Sentences below the lines."""
    first_to_go: tuple[str, ...] = ()
    """Columns that a terminal leaves out, in this order, where it is too narrow even with texts broken at spaces."""
    unbroken: frozenset[str] = frozenset()
    """Columns of texts that are not broken: they are typed elsewhere."""

    @property
    def headers(self) -> tuple[str, ...]:
        """Return the headings of the columns."""
        return self.headings or self.columns

    @property
    def right(self) -> tuple[bool, ...]:
        """Return for each column whether it is aligned to the right."""
        return tuple(name in self.numeric for name in self.columns)

    @property
    def wordy(self) -> bool:
        """Return whether it has sentences in its fields; a narrow screen stacks their lines, field below field."""
        return any(len(text) > WORDY for line in self.lines for text in line)

    def compact(self, keep: Collection[str] = ()) -> TextTable:
        """Return the table without columns that are empty in all lines, except for those to `keep`."""
        if not self.lines:
            return self
        texts = zip(self.columns, zip(*self.lines, strict=True), strict=True)
        filled = [name for name, column in texts if name in keep or any(text.strip(ABSENT) for text in column)]
        return self.only(filled)

    def only(self, names: Collection[str]) -> TextTable:
        """Return the table with these of its columns."""
        kept = [place for place, name in enumerate(self.columns) if name in names]
        return replace(
            self,
            columns=tuple(self.columns[place] for place in kept),
            lines=tuple(tuple(line[place] for place in kept) for line in self.lines),
            headings=tuple(self.headings[place] for place in kept) if self.headings else (),
        )


def sort_value(text: str) -> float | None:
    """Return what a text is sorted by in a column of numbers: the value of an `Entry`, else the number that it is."""
    if isinstance(text, Entry):
        return text.value
    try:
        return finite(float(text.replace("\u202f", "").replace("−", "-")))
    except ValueError:
        return None


def finite(value: object) -> float | None:
    """Return `value` if it is a finite number: nothing else can be sorted."""
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
    """Return a table without columns that are empty in all lines."""
    given = tuple(map(tuple, lines))
    return TextTable(title, tuple(columns), given, frozenset(numeric), kinds=tuple(kinds), notes=tuple(notes)).compact()


def records_table(
    title: str, records: Sequence[Mapping[str, Any]], columns: Sequence[str] = (), *, kinds: Sequence[str] = ()
) -> TextTable:
    """Return a table of records: these of their keys, by default all of them; numbers stand to the right."""
    shown = columns or tuple(dict.fromkeys(name for record in records for name in record))
    lines = [[Entry(field_text(one.get(name)), finite(one.get(name))) for name in shown] for one in records]
    numeric = [name for name in shown if any(finite(one.get(name)) is not None for one in records)]
    return text_table(title, shown, lines, numeric=numeric, kinds=kinds)


def field_text(value: Any) -> str:
    """Return a value as text on one line; empty for None."""
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
