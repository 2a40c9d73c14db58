"""``tactbench leaderboard``: prints or writes the ranked table of the results in a folder."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.shared import DEFAULT_FOLDER, options
from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.files import replace_file
from tactbench.core.leaderboard.formats import ALL, SUFFIXES, document, known_columns, rendered
from tactbench.core.leaderboard.formats import best as best_of
from tactbench.core.leaderboard.names import DEFAULT
from tactbench.core.leaderboard.table import Table
from tactbench.core.study.files import opened, shown_rows, table_of
from tactbench.core.tables.terminal import show

TABLE_FORMATS = ("table", "json", "md", "latex", "csv")
FOR_PEOPLE = ("table", "md", "latex")
"""Output formats for which --columns can be given."""


@click.command(name="leaderboard")
@click.argument("folder", type=click.Path(path_type=Path), default=DEFAULT_FOLDER, required=False)
@options(
    *(click.option(f"--{key}", multiple=True, metavar="NAME", help=f"Only this {key}; may be repeated.")
      for key in ("sensor", "task", "protocol", "split", "estimator")),
    click.option("--best", type=click.IntRange(min=1), is_flag=False, flag_value=1, metavar="[N]",
                 help="Show only the N best answers of each sensor in each block. Default of N: 1."),
    click.option("--columns", metavar="A,B,…", help="Columns to show, for example sensor,score,cell."),
    click.option("--wide", is_flag=True, help="All columns."),
    click.option("--format", "shape", type=click.Choice(TABLE_FORMATS),
                 help="Output format. Default: table, or the format of the suffix of --to."),
    click.option("--to", "-o", "to", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE",
                 help="Write a file: .txt, .md, .csv, .json, .tex, .parquet, .xlsx."),
)  # fmt: skip
def command(
    folder: Path, shape: str | None, to: Path | None, best: int | None, columns: str | None, wide: bool,
    **filters: tuple[str, ...],
) -> None:  # fmt: skip
    """Show the table of all results in a folder, in any format. FOLDER is that of `run --out`."""
    shape = shape or ("table" if to is None else SUFFIXES.get(to.suffix.lower()))
    if shape is None:
        raise UsageError(f"The suffix of {to} is not that of a table format.",
                         hint=f"Give a file that ends in {', '.join(SUFFIXES)}, or give --format.")  # fmt: skip
    if columns is not None and shape not in FOR_PEOPLE:
        raise UsageError(f"--format {shape} always has all columns.", hint=f"--columns is for {', '.join(FOR_PEOPLE)}.")
    names = known_columns(columns.split(",")) if columns is not None else ALL if wide else DEFAULT
    store = opened(folder)
    table = table_of(store, _only(shown_rows(store), filters))
    print_table(best_of(table, best) if best else table, shape, names, to=to)


def _only(rows: list[dict[str, Any]], filters: Mapping[str, Sequence[str]]) -> list[dict[str, Any]]:
    """Return the rows that pass all filters; raises UsageError for an unknown name, or if no row is left."""
    kept = rows
    for key, chosen in filters.items():
        known = {str(row[key]) for row in rows if row[key] is not None}
        for name in chosen:
            if name not in known:
                raise UnknownNameError(f"{key} among these results", name, known)
        kept = [row for row in kept if not chosen or row[key] in chosen]
    if not kept:
        raise UsageError(
            "No row passes all filters.", hint="Leave one filter out; `tactbench leaderboard --columns cell` lists all."
        )
    return kept


def print_table(table: Table, shape: str, columns: tuple[str, ...], *, to: Path | None = None) -> None:
    """Print a leaderboard on stdout, or write it to the file `to`.

    Parameters
    ----------
    shape
        Format: one of `TABLE_FORMATS`.

    Raises
    ------
    UsageError
        If the file cannot be written.
    """
    if shape == "table" and to is None and sys.stdout.isatty():
        show(document(table, columns))
        return
    content = rendered(table, shape, columns)
    if to is None:
        click.echo(content, nl=False)
        return
    try:
        replace_file(to, content)
    except OSError as error:
        raise UsageError(f"{to} cannot be written: {error.strerror or error}.", hint="Give another file.") from error
