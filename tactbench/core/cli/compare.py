"""``tactbench compare A B``: two sensors, estimators, protocols, splits or result folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

COMPARISON_FORMATS = ("table", "json", "md", "latex", "csv")


@click.command(name="compare")
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@click.option("--out", "folder", type=click.Path(path_type=Path), default=Path("tactbench-results"), show_default=True,
              help="Result folder, unless A and B are folders.")  # fmt: skip
@click.option("--task", help="This task only.")
@click.option("--config", metavar="FILE", help="Matrix whose declared comparisons p-values are corrected for.")
@click.option("--format", "shape", type=click.Choice(COMPARISON_FORMATS), default="table", show_default=True)
def command(first: str, second: str, folder: Path, task: str | None, config: str | None, shape: str) -> None:
    """Compare A and B replicate by replicate: two sensors, estimators, protocols, splits, or result folders.

    Of two folders the same cells are compared: before and after a change, or two laboratories.
    """
    from tactbench.core.cli.config import default_matrix, matrix_called
    from tactbench.core.cli.grid import print_records, print_tables
    from tactbench.core.cli.results import is_results
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.pairwise import (
        comparisons,
        folder_comparisons,
        record_of,
        tables_of,
        with_declared,
    )

    if all(is_results(Path(one)) for one in (first, second)):
        found = folder_comparisons(kept_rows(Path(first)), kept_rows(Path(second)), first, second, task)
    else:
        matrix = matrix_called(config) if config else default_matrix()
        rows = kept_rows(folder)
        found = with_declared(comparisons(rows, first, second, task), rows, matrix.comparisons)
    if not found:
        raise UsageError(
            f"{first} and {second} have no cell to compare" + (f" in task {task!r}." if task else "."),
            hint="See what there is with `tactbench leaderboard`.",
        )
    if shape in ("json", "csv"):
        print_records(list(map(record_of, found)), shape)
    else:
        print_tables(tables_of(found), shape)


def kept_rows(folder: Path) -> list[dict[str, Any]]:
    """Return the rows of a result folder; raises UsageError."""
    from tactbench.core.cli.results import opened, shown_rows

    return shown_rows(opened(folder))
