"""How verbs print a leaderboard, or write it to a file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import DEFAULT_FOLDER
from tactbench.core.tables.terminal import WITHOUT_EDGE, show

if TYPE_CHECKING:
    from tactbench.core.leaderboard.table import Table
    from tactbench.core.leaderboard.view import View

TABLE_FORMATS = ("table", "json", "md", "latex", "csv", "parquet", "xlsx")
FOR_PEOPLE = ("table", "md", "latex")
"""Formats that print less than everything."""
NO_TEXT = ("parquet", "xlsx")


def view_of(folder: Path, *, wide: bool = False, columns: str | None = None, shape: str = "table") -> View:
    """Return what is printed of a table.

    Parameters
    ----------
    columns
        Names, separated by commas.

    Raises
    ------
    UsageError
        If there is no such column, or `shape` always holds them all.
    """
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.view import View, known_columns

    if columns is not None and shape not in FOR_PEOPLE:
        raise UsageError(
            f"--format {shape} always holds all columns.", hint=f"--columns is for {', '.join(FOR_PEOPLE)}."
        )
    names = [name.strip() for name in columns.split(",")] if columns is not None else []
    where = "" if folder == DEFAULT_FOLDER else str(folder)
    return View(wide=wide, columns=known_columns(names), folder=where)


def format_of(shape: str | None, to: Path | None) -> str:
    """Return the format asked for, or what the name of the file says; raises UsageError if neither says one."""
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.formats import SUFFIXES

    found = shape or ("table" if to is None else SUFFIXES.get(to.suffix.lower()))
    if found is None:
        raise UsageError(f"The name of {to} says no format.",
                         hint=f"Let it end in {', '.join(SUFFIXES)}, or give --format.")  # fmt: skip
    return str(found)


def check_destination(shape: str, to: Path | None = None) -> None:
    """Refuse to write bytes to a terminal.

    Raises
    ------
    UsageError
        If `shape` is no text and stdout is a terminal.
    """
    from tactbench.core.errors import UsageError

    if shape in NO_TEXT and to is None and sys.stdout.isatty():
        raise UsageError(
            f"{shape} is no text for a terminal.",
            hint=f"Write it to a file: `tactbench leaderboard --to leaderboard.{shape}`, or into a pipe.",
        )


def print_table(table: Table, shape: str, view: View, *, to: Path | None = None) -> None:
    """Print a leaderboard on stdout, or write it to a file, in one of `TABLE_FORMATS`.

    Parameters
    ----------
    view
        What is printed of it in the formats `FOR_PEOPLE`.
    to
        The file to write in place of stdout.

    Raises
    ------
    UsageError
        If the file cannot be written.
    """
    from tactbench.core.errors import UsageError
    from tactbench.core.files import replace_file
    from tactbench.core.leaderboard.formats import rendered
    from tactbench.core.leaderboard.view import document

    if shape == "table" and to is None and sys.stdout.isatty():
        show(document(table, view))
        return
    content = rendered(table, shape, view, WITHOUT_EDGE)
    if to is None:
        click.echo(content, nl=False)
        return
    try:
        replace_file(to, content)
    except OSError as error:
        raise UsageError(f"{to} cannot be written: {error.strerror or error}.", hint="Give another file.") from error
