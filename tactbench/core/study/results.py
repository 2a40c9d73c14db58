"""Functions that open result folders and report files that cannot be read."""

from __future__ import annotations

from pathlib import Path

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.table import over_all
from tactbench.core.leaderboard.table import table_of as table_of
from tactbench.core.matrix.store import Row, Store
from tactbench.core.tables.terminal import remark


def is_results(folder: Path) -> bool:
    """Return True if a folder contains the file of at least one cell."""
    return any((folder / "cells").glob("*.h5"))


def opened(folder: Path) -> Store:
    """Return the store of a result folder; raises UsageError if the folder contains no results."""
    if not is_results(folder):
        raise UsageError(f"There are no results in {folder}.", hint="Compute results with `tactbench run --out DIR`.")
    return Store(folder)


def shown_rows(store: Store) -> list[Row]:
    """Return one row for each cell of a folder and report unreadable files; raises UsageError if no row can be read."""
    rows = store.rows()
    for one in store.troubles:
        remark(f"Left out: {one}")
    if not rows:
        raise UsageError(f"No result in {store.folder} can be read.", hint="Run `tactbench run` again.")
    return over_all(store, rows)
