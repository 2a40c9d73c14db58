"""``tactbench leaderboard``: the table of a result folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.comparisons import print_comparisons
from tactbench.core.cli.results import opened, provenance_of, shown_rows
from tactbench.core.cli.tables import TABLE_FORMATS, print_table
from tactbench.core.leaderboard.axes import AXES

if TYPE_CHECKING:
    from tactbench.core.matrix.store import Store


@click.command(name="leaderboard")
@click.argument("folder", type=click.Path(path_type=Path), default=Path("tactbench-results"), required=False)
@click.option("--format", "shape", type=click.Choice(TABLE_FORMATS),
              help="How it is shown; default: table, or what the name of the file given with --to says.")  # fmt: skip
@click.option("--to", "-o", "to", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE",
              help="Write a file: .md, .csv, .json, .tex, .html, .parquet.")  # fmt: skip
@click.option("--compare", "by", type=click.Choice(AXES), help="Show these side by side instead.")
@click.option("--no-times", "times", flag_value=False, default=True, type=bool,
              help="Only what a seed decides, no times and hosts: the same bytes on every machine.")  # fmt: skip
def command(folder: Path, shape: str | None, to: Path | None, by: str | None, times: bool) -> None:
    """Show the table of all results in a folder, in any format. FOLDER is what `run --out` wrote."""
    from tactbench.core.cli.tables import check_destination
    from tactbench.core.leaderboard.collector import collector_at_rest

    shape = shape or _meant(to)
    check_destination(shape, to, times=times)
    with collector_at_rest():
        _show(opened(folder), shape, to, by, times)


def _show(store: Store, shape: str, to: Path | None, by: str | None, times: bool) -> None:
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.files import table_of

    rows = shown_rows(store)
    if by is None:
        print_table(table_of(rows, store.folder, provenance_of(store, rows), times=times), shape, to=to)
    elif to is not None or not times:
        raise UsageError("A comparison is printed, and has no times.", hint="Leave out --to and --no-times.")
    else:
        print_comparisons(rows, by, shape)


def _meant(to: Path | None) -> str:
    if to is None:
        return "table"
    from tactbench.core.leaderboard.formats import SUFFIXES

    return SUFFIXES.get(to.suffix.lower(), "table")
