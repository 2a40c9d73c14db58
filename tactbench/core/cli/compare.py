"""``tactbench compare A B``: compares two sensors, estimators, protocols, splits or result folders."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.cli.grid import print_records, print_tables
from tactbench.core.cli.options import RESULTS, format_option
from tactbench.core.leaderboard.pairwise import (
    comparisons,
    folder_comparisons,
    record_of,
    tables_of,
    with_declared,
)
from tactbench.core.study.results import is_results, opened, shown_rows
from tactbench.core.study.shipped import matrix_called


@click.command(name="compare")
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@RESULTS
@click.option("--task", metavar="NAME", help="Compare results of this task only.")
@click.option("--config", metavar="FILE", help="Matrix whose declared comparisons p-values are corrected for.")
@format_option("table", "json", "md", "latex", "csv")
def command(first: str, second: str, out: Path, task: str | None, config: str | None, shape: str) -> None:
    """Compare A and B replicate by replicate: two sensors, estimators, protocols, splits, or result folders.

    With two folders, cells of the same name are compared: before and after a change, or of two laboratories.
    """
    if all(is_results(Path(one)) for one in (first, second)):
        before, after = (shown_rows(opened(Path(one))) for one in (first, second))
        found = folder_comparisons(before, after, first, second, task)
    else:
        matrix = matrix_called(config)
        rows = shown_rows(opened(out))
        found = with_declared(comparisons(rows, first, second, task), rows, matrix.comparisons)
    if shape in ("json", "csv"):
        print_records(list(map(record_of, found)), shape)
    else:
        print_tables(tables_of(found), shape)
