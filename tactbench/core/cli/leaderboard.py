"""``tactbench leaderboard``: the table of a result folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.comparisons import print_comparisons
from tactbench.core.cli.tables import TABLE_FORMATS, print_rows
from tactbench.core.leaderboard.axes import AXES

if TYPE_CHECKING:
    from tactbench.core.matrix.store import Store

_MOST_TOLD = 5
"""Rows that cannot be shown and are told one by one."""


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
        _show(_opened(folder), shape, to, by, times)


def _show(store: Store, shape: str, to: Path | None, by: str | None, times: bool) -> None:
    from tactbench.core.errors import UsageError

    rows = _rows(store)
    if by is None:
        made_by = sorted({row["made_by"] for row in rows if row["made_by"]})
        provenance = [known for known in map(store.provenance, made_by) if known]
        print_rows(rows, shape, provenance, times=times, to=to, folder=store.folder)
    elif to is not None or not times:
        raise UsageError("A comparison is printed, and has no times.", hint="Leave out --to and --no-times.")
    else:
        print_comparisons(rows, by, shape)


def _meant(to: Path | None) -> str:
    if to is None:
        return "table"
    from tactbench.core.leaderboard.formats import SUFFIXES

    return SUFFIXES.get(to.suffix.lower(), "table")


def _opened(folder: Path) -> Store:
    from tactbench.core.errors import UsageError
    from tactbench.core.matrix.store import Store

    if not (folder / "cells").is_dir():
        raise UsageError(f"There are no results in {folder}.", hint="Make some with `tactbench run --out DIR`.")
    return Store(folder)


def _rows(store: Store) -> list[dict[str, Any]]:
    """Return the rows of a folder that a table can be made of; tell of the others."""
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.checked import checked
    from tactbench.core.leaderboard.text import cut, visible
    from tactbench.core.matrix.leaving import fill_baselines

    rows, wrong = checked(store.rows())
    told = [cut(visible(one), 300) for one in (*getattr(store, "troubles", ()), *wrong)]
    if not rows:
        raise UsageError(
            f"{store.folder} has no row that can be shown" + (f": {told[0]}." if told else "."),
            hint="Run `tactbench run` again.",
        )
    for one in told[:_MOST_TOLD]:
        remark(f"Left out: {one}")
    if len(told) > _MOST_TOLD:
        remark(f"Left out: {len(told) - _MOST_TOLD} more rows.")
    fill_baselines(rows)
    return rows
