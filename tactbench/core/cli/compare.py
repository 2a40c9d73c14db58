"""``tactbench compare A B``: compares two sensors, estimators, protocols, splits or result folders."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.cli.shared import RESULTS, format_option, print_records, print_tables
from tactbench.core.leaderboard.pairwise import comparisons, folder_comparisons, record_of, tables_of
from tactbench.core.study.files import is_results, opened, shown_rows


@click.command(name="compare")
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@RESULTS
@click.option("--task", metavar="NAME", help="Compare results of this task only.")
@format_option("table", "json", "md", "latex", "csv")
def command(first: str, second: str, out: Path, task: str | None, shape: str) -> None:
    """Compare A and B replicate by replicate: two sensors, estimators, protocols, splits, or result folders.

    With two folders, cells of the same name are compared: before and after a change, or of two laboratories.
    """
    if all(is_results(Path(one)) for one in (first, second)):
        before, after = (shown_rows(opened(Path(one))) for one in (first, second))
        found = folder_comparisons(before, after, first, second, task)
    else:
        found = comparisons(shown_rows(opened(out)), first, second, task)
    if shape in ("json", "csv"):
        print_records(list(map(record_of, found)), shape)
    else:
        print_tables(tables_of(found), shape)
