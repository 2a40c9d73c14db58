"""The parts of a report: finished cells, their answers and recordings, figures and sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import DataError
from tactbench.core.leaderboard.table import Table, over_all, table_of
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.samples import Answers
from tactbench.core.tables.text_table import TextTable

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry


MOST_CELLS = 500
"""A page of more cells has no details: each cell takes reading a file and 20 kB."""


@dataclass(frozen=True)
class SavedFigure:
    """A figure that has been saved."""

    name: str
    """Short, fit for a file name and an anchor: ``force-against-time``."""
    title: str
    """The question that it answers."""
    caption: str
    """Description of axes and marks, in sentences that a paper could use."""
    png: Path
    """Path of the picture; the PDF lies beside it."""


@dataclass(frozen=True)
class Results:
    """A result folder, opened for reading.

    Parameters
    ----------
    registry
        Where specs of sensors and tasks are looked up.
    rows
        One a cell, the latest of each name.
    replicates
        The rows as they are stored, one a cell and replicate, by key.
    drawn
        The figures of these results.
    """

    store: Store
    registry: Registry
    rows: tuple[Row, ...]
    replicates: Mapping[str, Row] = field(default_factory=dict)
    drawn: tuple[SavedFigure, ...] = ()
    undrawn: tuple[str, ...] = ()
    """One sentence for each figure that could not be made."""

    @cached_property
    def leaderboard(self) -> Table:
        """Return the rows as ranked tables."""
        return table_of(self.store, self.rows)

    @cached_property
    def anchors(self) -> dict[str, str]:
        """Return the anchor of the details of each cell, by the cell's name; none of too many cells."""
        lines = self.leaderboard.lines if len(self.rows) <= MOST_CELLS else ()
        return {str(line.row["cell"]): f"cell-{place}" for place, line in enumerate(lines, 1)}

    def answers(self, row: Mapping[str, Any]) -> dict[str, Answers]:
        """Return the answers of a cell by role; empty if it did not finish."""
        return self.store.answers(str(row["key"]))

    def replicate(self, row: Row) -> Row:
        """Return the row of the replicate whose answers are stored for a cell, with the number of replicates."""
        return {**self.replicates.get(str(row["key"]), row), "repeats": row["repeats"]}

    def recordings(self, row: Mapping[str, Any]) -> list[Path]:
        """Return the files of a cell's recordings, in the order that ``Answers.recording`` counts.

        Raises
        ------
        DataError
            If one is not there.
        """
        found = []
        for path, recording in self.store.recordings(row):
            if recording is None:
                raise DataError(
                    f"The recording {path} that {row['cell']} was answered from is not there.",
                    hint="Put it back, or run the cell again.",
                )
            found.append(recording)
        return found


def open_results(store: Store, registry: Registry) -> Results:
    """Return the results of `store`: one row for each cell."""
    rows = store.rows()
    shown = tuple(over_all(store, rows))
    return Results(store, with_declared_of(registry, shown), shown, {str(row["key"]): row for row in rows})


@dataclass(frozen=True)
class Details:
    """Everything that is known about one cell."""

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
    """One sentence for each thing that the section lacks."""
