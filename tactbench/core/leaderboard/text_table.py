"""A table of text: what every format for people renders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["result", "baseline", "failed", "skipped", "alarm", "plain"]
"""Of a line: an answer, a trivial one, a cell that did not end well or was not begun; a line of another table, and one
that a reader should look at first."""


@dataclass(frozen=True)
class TextTable:
    """A title, columns, lines and notes."""

    title: str
    columns: tuple[str, ...]
    """Names of the columns."""
    lines: tuple[tuple[str, ...], ...]
    """One text a column."""
    numeric: frozenset[str] = frozenset()
    """Columns aligned to the right."""
    headings: tuple[str, ...] = ()
    """What stands above the columns, if not their names."""
    kinds: tuple[Kind, ...] = ()
    """One a line; none: all are plain."""
    summary: tuple[str, ...] = ()
    """Sentences below the title."""
    notes: tuple[str, ...] = ()
    """Sentences below the lines."""
    detail: bool = False
    """Whether it only gives details of what stands in other tables, and is printed with them all."""
    records: tuple[Mapping[str, Any], ...] = ()
    """The same as numbers; all have the same keys."""

    @property
    def headers(self) -> tuple[str, ...]:
        """What stands above the columns."""
        return self.headings or self.columns

    @property
    def right(self) -> tuple[bool, ...]:
        """Whether each column is aligned to the right."""
        return tuple(name in self.numeric for name in self.columns)
