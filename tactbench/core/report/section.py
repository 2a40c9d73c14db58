"""What the page is made from, and the parts that it is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from tactbench.core.leaderboard.table import Block, Table, build_table
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]
MOST_ROWS = 2_000
"""Of the page: of more, it shows the first of each block."""


@dataclass(frozen=True)
class ReportData:
    """Everything that a page is about."""

    results: Results
    drawn: Sequence[SavedFigure] = ()
    undrawn: tuple[str, ...] = ()
    """Why figures are missing, a sentence each."""

    @property
    def rows(self) -> tuple[Row, ...]:
        """One a cell."""
        return self.results.rows

    @cached_property
    def leaderboard(self) -> Table:
        """The rows as ranked tables."""
        questions = {one.name: one.spec.question for one in self.results.registry.tasks}
        return build_table(self.rows, self.results.provenance(), questions=questions)

    @cached_property
    def blocks(self) -> list[Block]:
        """The blocks of the leaderboard, each with the lines that the page shows."""
        blocks = self.leaderboard.blocks
        most = MOST_ROWS if len(self.rows) <= MOST_ROWS else max(1, MOST_ROWS // len(blocks))
        return [replace(block, lines=block.lines[:most]) for block in blocks]

    @cached_property
    def shown(self) -> list[Row]:
        """The rows of these lines."""
        return [line.row for block in self.blocks for line in block.lines]

    @cached_property
    def anchors(self) -> dict[str, str]:
        """Where the page tells everything about a cell, by the cell's name."""
        return {str(row["cell"]): f"cell-{place}" for place, row in enumerate(self.shown, 1)}


@dataclass(frozen=True)
class Details:
    """Everything that is known about one cell, to be unfolded."""

    cell: str
    status: str
    pairs: Mapping[str, Mapping[str, str]]
    """Titled lists of names and values."""
    tables: tuple[TextTable, ...]
    texts: Mapping[str, str]
    """Titled texts of many lines."""


@dataclass(frozen=True)
class Section:
    """A part of the page. Text between backticks is shown as code; none of it is markup."""

    anchor: str = ""
    title: str = ""
    paragraphs: tuple[str, ...] = ()
    tables: tuple[TextTable, ...] = ()
    pictures: tuple[SavedFigure, ...] = ()
    details: tuple[Details, ...] = ()
    missing: tuple[str, ...] = ()
    """What the section lacks: one sentence each, with the command that makes it."""
