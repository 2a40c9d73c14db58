"""How verbs open a result folder: what can be shown of it, and what is left out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tactbench.core.leaderboard.table import Table
    from tactbench.core.matrix.store import Store


def is_results(folder: Path) -> bool:
    """Return whether a folder holds cells that a run has ended."""
    return any((folder / "cells").glob("*.h5"))


def opened(folder: Path) -> Store:
    """Return a result folder; raises UsageError if there is none."""
    from tactbench.core.errors import UsageError
    from tactbench.core.matrix.store import Store

    if not is_results(folder):
        raise UsageError(f"There are no results in {folder}.", hint="Make some with `tactbench run --out DIR`.")
    return Store(folder)


def shown_rows(store: Store) -> list[dict[str, Any]]:
    """Return a row for each cell of a folder; tell of files that cannot be read.

    Raises
    ------
    UsageError
        If there is none.
    """
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.table import over_all

    rows = store.rows()
    for one in store.troubles:
        remark(f"Left out: {one}")
    if not rows:
        raise UsageError(f"{store.folder} has no row that can be shown.", hint="Run `tactbench run` again.")
    return over_all(store, rows)


def table_of(store: Store, rows: Sequence[Mapping[str, Any]], *, times: bool = True) -> Table:
    """Return the leaderboard of rows, one a cell; `times` as of `build_table`."""
    from tactbench.core.cli.tables import questions_of
    from tactbench.core.leaderboard.table import build_table

    return build_table(rows, provenance_of(store, rows), times=times, questions=questions_of(rows))


def provenance_of(store: Store, rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return what is known of the runs that `rows` are from."""
    made_by = sorted({str(row["made_by"]) for row in rows if row.get("made_by")})
    return [known for known in map(store.provenance, made_by) if known]
