"""What a report is made of: finished cells, what they answered, the recordings behind them, and figures of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import DataError
from tactbench.core.leaderboard.levels import with_levels
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.samples import Answers
from tactbench.core.statistics.replicates import over_replicates

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry


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
    """

    store: Store
    registry: Registry
    rows: tuple[Row, ...]
    replicates: Mapping[str, Row] = field(default_factory=dict)

    def answers(self, row: Mapping[str, Any]) -> dict[str, Answers]:
        """Return what a cell answered, by role; empty if it did not finish."""
        return self.store.answers(str(row["key"]))

    def replicate(self, row: Row) -> Row:
        """Return the row of the one replicate whose answers and recordings a cell's row leads to."""
        return self.replicates.get(str(row["key"]), row)

    def provenance(self) -> list[dict[str, Any]]:
        """Return what is known of the runs that the rows are from."""
        made_by = sorted({str(row["made_by"]) for row in self.rows if row.get("made_by")})
        return [known for known in map(self.store.provenance, made_by) if known]

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
    """Return what `store` holds: a row a cell."""
    rows = store.rows()
    shown = tuple(with_levels(over_replicates(rows), store.folder, store.provenance))
    return Results(store, with_declared_of(registry, shown), shown, {str(row["key"]): row for row in rows})


@dataclass(frozen=True)
class SavedFigure:
    """One figure."""

    name: str
    """Short, fit for a file name and an anchor: ``force-against-time``."""
    title: str
    """The question that it answers."""
    caption: str
    """What is on the axes and how to read it, in sentences a paper could use."""
    png: Path
    """Its PDF lies beside it."""
