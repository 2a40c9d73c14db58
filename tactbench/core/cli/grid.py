"""How verbs print records that are no leaderboard: a table for people, JSON or CSV for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import click

GRID_FORMATS = ("table", "json", "csv")


def print_grid(
    title: str,
    columns: Sequence[str],
    rows: Sequence[Mapping[str, str]],
    *,
    numeric: Sequence[str] = (),
    styles: Sequence[str] = (),
) -> None:
    """Print rows of text on stdout; text from plugins is never read as markup.

    Parameters
    ----------
    title
        Stands above the table.
    columns
        Keys of the rows, in order; a column without any entry is not shown.
    numeric
        Columns aligned to the right.
    styles
        One style a row, or none at all.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from tactbench.core.cli.screen import console

    screen = console()
    screen.print(Text(title, style="bold"))
    grid = Table(box=box.SIMPLE_HEAD)
    shown = [column for column in columns if any(row.get(column) for row in rows)]
    for column in shown:
        grid.add_column(Text(column), justify="right" if column in numeric else "left", overflow="fold")
    for place, row in enumerate(rows):
        style = styles[place] if styles else ""
        grid.add_row(*(Text(row.get(column, "")) for column in shown), style=style)
    screen.print(grid)


def print_records(records: Sequence[Mapping[str, Any]], shape: str) -> None:
    """Print records on stdout as ``json`` or ``csv``; all have the keys of the first."""
    if shape == "json":
        click.echo(json.dumps(list(records), indent=1, ensure_ascii=False, allow_nan=False))
        return
    click.echo(csv_text(records), nl=False)


def csv_text(records: Sequence[Mapping[str, Any]]) -> str:
    """Return records as CSV with a header."""
    import csv
    import io

    out = io.StringIO()
    writer = csv.DictWriter(out, fieldnames=list(records[0]) if records else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return out.getvalue()
