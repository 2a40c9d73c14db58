"""How a result folder is opened: what can be shown of it, and what is left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.table import Table, build_table, over_all
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import installed
from tactbench.core.tables.terminal import remark


def is_results(folder: Path) -> bool:
    """Return whether a folder holds cells that a run has ended."""
    return any((folder / "cells").glob("*.h5"))


def opened(folder: Path) -> Store:
    """Return a result folder; raises UsageError if there is none."""
    if not is_results(folder):
        raise UsageError(f"There are no results in {folder}.", hint="Make some with `tactbench run --out DIR`.")
    return Store(folder)


def shown_rows(store: Store) -> list[Row]:
    """Return a row for each cell of a folder; tell of files that cannot be read.

    Raises
    ------
    UsageError
        If there is none.
    """
    rows = store.rows()
    for one in store.troubles:
        remark(f"Left out: {one}")
    if not rows:
        raise UsageError(f"{store.folder} has no row that can be shown.", hint="Run `tactbench run` again.")
    return over_all(store, rows)


def table_of(store: Store, rows: Sequence[Mapping[str, Any]], *, times: bool = True) -> Table:
    """Return the leaderboard of rows, one a cell; `times` as of `build_table`. A task not installed asks nothing."""
    tasks = installed().tasks
    names = {str(row["task"]) for row in rows}.intersection(tasks.names())
    questions = {name: tasks[name].spec.question for name in names}
    made_by = sorted({str(row["made_by"]) for row in rows if row.get("made_by")})
    provenance = [known for known in map(store.provenance, made_by) if known]
    return build_table(rows, provenance, times=times, questions=questions)
