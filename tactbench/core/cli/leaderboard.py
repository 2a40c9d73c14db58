"""``tactbench leaderboard``: the table of a result folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.comparisons import COMPARISON_FORMATS, print_comparisons
from tactbench.core.cli.results import opened, provenance_of, shown_rows
from tactbench.core.cli.tables import DEFAULT_FOLDER, TABLE_FORMATS, format_of, print_table, questions_of, view_of
from tactbench.core.leaderboard import AXES

if TYPE_CHECKING:
    from tactbench.core.leaderboard.view import View
    from tactbench.core.matrix.store import Store

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
@click.option("--compare", "by", type=click.Choice(AXES), help="Show these side by side instead.")
@click.option("--no-times", "times", flag_value=False, default=True, type=bool,
              help="Only what a seed decides, no times and hosts: the same bytes on every machine.")  # fmt: skip
def command(
    folder: Path, shape: str | None, to: Path | None, by: str | None, times: bool, best: int | None,
    columns: str | None, wide: bool, **filters: tuple[str, ...],
) -> None:  # fmt: skip
    """Show the table of all results in a folder, in any format. FOLDER is what `run --out` wrote."""
    from tactbench.core.cli.tables import check_destination

    shape = format_of(shape, to)
    check_destination(shape, to)
    view = view_of(folder, wide=wide, columns=columns, shape=shape)
    _show(opened(folder), shape, to, by, times, best, view, filters)


def _show(
    store: Store, shape: str, to: Path | None, by: str | None, times: bool, count: int | None, view: View,
    filters: Mapping[str, Sequence[str]],
) -> None:  # fmt: skip
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.side_by_side import compare
    from tactbench.core.leaderboard.table import build_table
    from tactbench.core.leaderboard.view import best

    every = shown_rows(store)
    rows = _only(every, filters)
    view = replace(view, all_rows=len(rows) == len(every))
    if by is None:
        table = build_table(rows, provenance_of(store, rows), times=times, questions=questions_of(rows))
        print_table(best(table, count) if count else table, shape, view, to=to)
    elif to is not None or not times or count:
        raise UsageError("A comparison is printed whole, and has no times.", hint="Leave out --to, --best, --no-times.")
    elif shape not in COMPARISON_FORMATS:
        raise UsageError(
            f"A comparison cannot be printed as {shape}.", hint=f"Formats: {', '.join(COMPARISON_FORMATS)}."
        )
    else:
        tables = compare(rows, by)
        if not tables:
            raise UsageError(
                f"These rows hold no question that was asked with more than one {by}.",
                hint="Ask so first, for example `tactbench run --config protocols` or `tactbench run --config beyond`.",
            )
        print_comparisons(tables, shape)


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
