"""Data of a report: result rows with their answers and recordings, figures and sections."""

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
"""Largest number of cells whose details a page shows; each takes 20 kB and the reading of a file."""


@dataclass(frozen=True)
class SavedFigure:
    """A figure saved as PNG and PDF, with title and caption."""

    name: str
    """Short name for files and anchors, such as ``force-against-time``."""
    title: str
    """Heading: the question that the figure answers."""
    caption: str
    """Description of axes and marks, in complete sentences as for a paper."""
    png: Path
    """Path of the PNG file; the PDF has the same path with another suffix."""


@dataclass(frozen=True)
class Results:
    """The results of a folder, opened for reading, with the figures drawn from them.

    Parameters
    ----------
    registry
        Registry with the specs of sensors and tasks.
    rows
        One row for each cell, over its replicates.
    replicates
        The stored rows, one for each cell and replicate, by key.
    drawn
        Figures drawn from these results.
    """

    store: Store
    registry: Registry
    rows: tuple[Row, ...]
    replicates: Mapping[str, Row] = field(default_factory=dict)
    drawn: tuple[SavedFigure, ...] = ()
    undrawn: tuple[str, ...] = ()
    """One sentence for each figure that could not be drawn."""

    @cached_property
    def leaderboard(self) -> Table:
        """The rows arranged as ranked tables."""
        return table_of(self.store, self.rows)

    @cached_property
    def anchors(self) -> dict[str, str]:
        """HTML anchor of each cell's details, by name of the cell; empty for more than `MOST_CELLS` cells."""
        lines = self.leaderboard.lines if len(self.rows) <= MOST_CELLS else ()
        return {str(line.row["cell"]): f"cell-{place}" for place, line in enumerate(lines, 1)}

    def answers(self, row: Mapping[str, Any]) -> dict[str, Answers]:
        """Return the answers of a cell by role; empty if the cell did not finish."""
        return self.store.answers(str(row["key"]))

    def replicate(self, row: Row) -> Row:
        """Return the row of the replicate whose answers represent a cell, with the cell's number of replicates."""
        return {**self.replicates.get(str(row["key"]), row), "repeats": row["repeats"]}

    def recordings(self, row: Mapping[str, Any]) -> list[Path]:
        """Return the paths of a cell's recordings; ``Answers.recording`` is an index into this list.

        Raises
        ------
        DataError
            If a recording does not exist.
        """
        found = []
        for path, recording in self.store.recordings(row):
            if recording is None:
                raise DataError(
                    f"The recording {path}, on which {row['cell']} was evaluated, does not exist.",
                    hint="Put the file back, or run the cell again.",
                )
            found.append(recording)
        return found


def open_results(store: Store, registry: Registry) -> Results:
    """Return the results of the folder `store`, with the registry of its sensors and tasks."""
    rows = store.rows()
    shown = tuple(over_all(store, rows))
    return Results(store, with_declared_of(registry, shown), shown, {str(row["key"]): row for row in rows})


@dataclass(frozen=True)
class Details:
    """Details of one cell for the report page."""

    cell: str
    status: str
    pairs: Mapping[str, Mapping[str, str]]
    """Names and values, by title of their group."""
    tables: tuple[TextTable, ...]
    texts: Mapping[str, str]
    """Texts of many lines, such as a log, by title."""


@dataclass(frozen=True)
class Section:
    """A section of the report page. Text between backticks is shown as code; other markup is escaped."""

    anchor: str = ""
    title: str = ""
    paragraphs: tuple[str, ...] = ()
    tables: tuple[TextTable, ...] = ()
    pictures: tuple[SavedFigure, ...] = ()
    details: tuple[Details, ...] = ()
    missing: tuple[str, ...] = ()
    """One sentence for each missing part of the section."""
