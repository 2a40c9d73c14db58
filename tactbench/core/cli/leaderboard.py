"""``tactbench leaderboard``: the table of a result folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.options import DEFAULT_FOLDER
from tactbench.core.cli.tables import TABLE_FORMATS, check_destination, format_of, print_table, view_of

_FILTERS = ("sensor", "task", "protocol", "split", "estimator")


def _filters(command: Any) -> Any:
    for key in reversed(_FILTERS):
        option = click.option(f"--{key}", multiple=True, metavar="NAME", help=f"Only this {key}; may be repeated.")
        command = option(command)
    return command


@click.command(name="leaderboard")
@click.argument("folder", type=click.Path(path_type=Path), default=DEFAULT_FOLDER, required=False)
@_filters
@click.option("--best", type=click.IntRange(min=1), is_flag=False, flag_value=1, metavar="[N]",
              help="Only the first N answers of each sensor in each block; N is 1 where it is left out.")  # fmt: skip
@click.option("--columns", metavar="A,B,…", help="These columns, for example sensor,score,cell.")
@click.option("--wide", is_flag=True, help="All columns.")
@click.option("--format", "shape", type=click.Choice(TABLE_FORMATS),
              help="How it is shown; default: table, or what the name of the file given with --to says.")  # fmt: skip
@click.option("--to", "-o", "to", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE",
              help="Write a file: .txt, .md, .csv, .json, .tex, .parquet, .xlsx.")  # fmt: skip
@click.option("--no-times", "times", flag_value=False, default=True, type=bool,
              help="Only what a seed decides, no times and hosts: the same bytes on every machine.")  # fmt: skip
def command(
    folder: Path, shape: str | None, to: Path | None, times: bool, best: int | None, columns: str | None, wide: bool,
    **filters: tuple[str, ...],
) -> None:  # fmt: skip
    """Show the table of all results in a folder, in any format. FOLDER is what `run --out` wrote."""
    from tactbench.core.leaderboard.view import best as best_of
    from tactbench.core.study.results import opened, shown_rows, table_of

    shape = format_of(shape, to)
    check_destination(shape, to)
    view = view_of(folder, wide=wide, columns=columns, shape=shape)
    store = opened(folder)
    every = shown_rows(store)
    rows = _only(every, filters)
    table = table_of(store, rows, times=times)
    view = replace(view, all_rows=len(rows) == len(every))
    print_table(best_of(table, best) if best else table, shape, view, to=to)


def _only(rows: list[dict[str, Any]], filters: Mapping[str, Sequence[str]]) -> list[dict[str, Any]]:
    """Return the rows that are asked for; raises UsageError for a name that none has, or where none is left."""
    from tactbench.core.errors import UnknownNameError, UsageError

    kept = rows
    for key, chosen in filters.items():
        known = {str(row[key]) for row in rows if row[key] is not None}
        for name in chosen:
            if name not in known:
                raise UnknownNameError(f"{key} among these results", name, known)
        kept = [row for row in kept if not chosen or row[key] in chosen]
    if not kept:
        raise UsageError(
            "No row is all that at once.", hint="Ask for less: see `tactbench leaderboard --columns cell`."
        )
    return kept
