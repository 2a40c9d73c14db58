"""How verbs print tables and records: for people as a table, Markdown or LaTeX, for programs as JSON or CSV."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.tables.text_table import TextTable

GRID_FORMATS = ("table", "json", "csv")


def print_grid(
    title: str,
    columns: Sequence[str],
    rows: Sequence[Mapping[str, str]],
    *,
    numeric: Collection[str] = (),
    kinds: Sequence[str] = (),
) -> None:
    """Print rows of text on stdout as a table.

    Parameters
    ----------
    columns
        Keys of the rows, in order; a column without any entry is not shown.
    numeric
        Columns aligned to the right.
    kinds
        One word a row, by which it looks; see `tactbench.core.tables.terminal`.
    """
    from tactbench.core.tables.text_table import text_table

    lines = [[row.get(column, "") for column in columns] for row in rows]
    print_tables([text_table(title, columns, lines, numeric=numeric, kinds=kinds)])


def print_tables(tables: Sequence[TextTable], shape: str = "table") -> None:
    """Print tables on stdout as ``table``, ``md`` or ``latex``."""
    from tactbench.core.cli.screen import console
    from tactbench.core.tables.latex import latex
    from tactbench.core.tables.markdown import markdown
    from tactbench.core.tables.terminal import show

    if shape == "table":
        show(tables, console())
    else:
        click.echo((markdown if shape == "md" else latex)(tables), nl=False)


def print_records(records: Sequence[Mapping[str, Any]], shape: str) -> None:
    """Print records on stdout as ``json`` or ``csv``; all have the keys of the first."""
    from tactbench.core.tables.csv_text import csv_of_records

    if shape == "json":
        click.echo(json_text(list(records), indent=1))
    else:
        click.echo(csv_of_records(records), nl=False)
