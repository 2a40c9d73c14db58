"""Opens result folders, and reports files that cannot be read."""

from __future__ import annotations

from pathlib import Path

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.table import over_all
from tactbench.core.leaderboard.table import table_of as table_of
from tactbench.core.matrix.store import Row, Store
from tactbench.core.tables.terminal import remark


def is_results(folder: Path) -> bool:
    """Return whether a folder holds cells that have ended."""
    return any((folder / "cells").glob("*.h5"))


def opened(folder: Path) -> Store:
    """Return a result folder; raises UsageError if there is none."""
    if not is_results(folder):
        raise UsageError(f"There are no results in {folder}.", hint="Make some with `tactbench run --out DIR`.")
    return Store(folder)


def shown_rows(store: Store) -> list[Row]:
    """Return a row for each cell of a folder, and report unreadable files; raises UsageError if no row is left."""
    rows = store.rows()
    for one in store.troubles:
        remark(f"Left out: {one}")
    if not rows:
        raise UsageError(f"{store.folder} has no row that can be shown.", hint="Run `tactbench run` again.")
    return over_all(store, rows)
