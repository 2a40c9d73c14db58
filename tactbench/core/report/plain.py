"""One kind of table for everything on the page: a title, columns, lines of entries, notes."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from tactbench.core.leaderboard.markdown import markdown_grid, markdown_note

ABSENT = "–"
WORDY = 60
"""Letters from which a field wraps as prose."""
_DIGITS = r"[-+−]?[\d\u202f]+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_NUMBER = re.compile(rf"({_DIGITS})(?: … {_DIGITS})?(?: %)?(?: ?[†‡*])*")


@dataclass(frozen=True)
class Entry:
    """One field of a table."""

    text: str
    value: float | None = None
    """What a column of numbers is sorted by, in one unit for the whole column; None sorts last."""
    anchor: str = ""
    """Where the page tells more: the anchor of the cell that the number is from."""


@dataclass(frozen=True)
class PlainTable:
    """A table, ready for any renderer."""

    title: str
    columns: tuple[str, ...]
    lines: tuple[tuple[Entry, ...], ...]
    numeric: frozenset[str] = frozenset()
    """Columns aligned to the right and sorted by value."""
    notes: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    """One word a line: ``result``, ``baseline``, ``failed`` …; empty: all alike."""
    said: tuple[str, ...] = ()
    """What it comes to, in sentences above it."""
    anchor: str = ""
    """Where links to the whole table lead; empty: nowhere."""

    @property
    def wordy(self) -> bool:
        """Whether it has sentences in its fields: on a narrow screen its lines are stacked, field below field."""
        return any(len(entry.text) > WORDY for line in self.lines for entry in line)


def plain(
    title: str,
    columns: Sequence[str],
    lines: Iterable[Sequence[str | Entry]],
    *,
    numeric: Collection[str] = (),
    notes: Sequence[str] = (),
    kinds: Sequence[str] = (),
) -> PlainTable:
    """Return a table without the columns that no line says anything in.

    Parameters
    ----------
    lines
        One field a column. Text in a column of numbers gets its value if it is a bare number, with or without marks;
        text with a unit gets none, since two lines may have two units: give an `Entry` there.
    """
    full = [
        tuple(
            one if isinstance(one, Entry) else Entry(one, number(one) if name in numeric else None)
            for name, one in zip(columns, line, strict=True)
        )
        for line in lines
    ]
    shown = [place for place in range(len(columns)) if any(line[place].text.strip(ABSENT) for line in full)]
    return PlainTable(
        title=title,
        columns=tuple(columns[place] for place in shown),
        lines=tuple(tuple(line[place] for place in shown) for line in full),
        numeric=frozenset(numeric) & {columns[place] for place in shown},
        notes=tuple(notes),
        kinds=tuple(kinds),
    )


def number(text: str) -> float | None:
    """Return the number that `text` is, thin spaces and marks aside, or None; of an interval its lower end."""
    found = _NUMBER.fullmatch(text.strip())
    return float(found[1].replace("\u202f", "").replace("−", "-")) if found and any(map(str.isdigit, text)) else None


def finite(value: object) -> float | None:
    """Return `value` if it is a finite number: nothing else can be sorted."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def markdown(table: PlainTable) -> str:
    """Return the table as Markdown, its notes as a list below."""
    lines = [[entry.text for entry in line] for line in table.lines]
    parts = markdown_grid(table.title, table.columns, table.numeric, lines)
    parts += ["", *(f"- {markdown_note(note)}" for note in table.notes)] if table.notes else []
    return "\n".join(parts) + "\n"
