"""Output of tables and records on stdout: as text, Markdown or LaTeX for people, as JSON or CSV for programs."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.tables.text import csv_text, json_text, visible
from tactbench.core.tables.text_table import field_text as field_text
from tactbench.core.tables.text_table import records_table

if TYPE_CHECKING:
    from tactbench.core.tables.text_table import TextTable

GRID_FORMATS = ("table", "json", "csv")


def print_tables(tables: Sequence[TextTable], shape: str = "table") -> None:
    """Print tables on stdout as ``table``, ``md`` or ``latex``."""
    from tactbench.core.tables.latex import latex
    from tactbench.core.tables.markdown import markdown
    from tactbench.core.tables.terminal import show

    if shape == "table":
        show(tables)
    else:
        click.echo((markdown if shape == "md" else latex)(tables), nl=False)


def print_fields(fields: Sequence[tuple[str, str]]) -> None:
    """Print (name, value) pairs on stdout, one line for each; long values are wrapped to the terminal's width."""
    from tactbench.core.tables.terminal import WITHOUT_EDGE

    left = max((len(name) for name, _ in fields), default=0) + 2
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else WITHOUT_EDGE
    for name, value in fields:
        lines = textwrap.wrap(
            f"{visible(name):<{left}}{visible(value)}", width, subsequent_indent=" " * left,
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
        click.echo("\n".join(lines))


def print_records(
    records: Sequence[Mapping[str, Any]], shape: str, *, title: str = "", columns: Sequence[str] = (),
    kinds: Sequence[str] = (),
) -> None:  # fmt: skip
    """Print records on stdout as ``json``, ``csv`` or ``table``; the keys of the first record apply to all.

    Parameters
    ----------
    title, columns, kinds
        For a table: its title; the keys shown as columns (default: all), empty columns left out; and one word for each
        record that selects the style of its line, see `tactbench.core.tables.terminal`.
    """
    if shape == "json":
        click.echo(json_text(list(records), indent=1))
    elif shape == "csv":
        click.echo(csv_text(records[0] if records else (), (one.values() for one in records)), nl=False)
    elif records:
        print_tables([records_table(title, records, columns or tuple(records[0]), kinds=kinds)])
