"""How verbs print a leaderboard, or write it to a file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.screen import console, width_without_terminal

if TYPE_CHECKING:
    from tactbench.core.leaderboard.table import Table

TABLE_FORMATS = ("table", "json", "md", "latex", "csv", "parquet", "html")


def check_destination(shape: str, to: Path | None = None, *, times: bool = True) -> None:
    """Refuse to write bytes to a terminal, and a page without times.

    Raises
    ------
    UsageError
        If `shape` is no text and stdout is a terminal, or `shape` is the page and `times` is false.
    """
    from tactbench.core.errors import UsageError

    if shape == "html" and not times:
        raise UsageError("The page shows every cell in full, times too.", hint="Use another --format.")
    if shape == "parquet" and to is None and sys.stdout.isatty():
        raise UsageError(
            "Parquet is no text for a terminal.",
            hint="Write it to a file: `tactbench leaderboard --to leaderboard.parquet`, or into a pipe.",
        )


def print_table(table: Table, shape: str, *, to: Path | None = None) -> None:
    """Print a leaderboard on stdout, or write it to a file, in one of `TABLE_FORMATS`.

    Parameters
    ----------
    to
        The file to write in place of stdout.

    Raises
    ------
    UsageError
        If the file cannot be written.
    """
    from tactbench.core.leaderboard.collector import collector_at_rest

    if shape == "table" and to is None and sys.stdout.isatty():
        from tactbench.core.leaderboard.terminal import show

        show(table, console())
    elif shape == "parquet":
        from tactbench.core.leaderboard.parquet import parquet

        _put(parquet(table), to)
    elif shape == "table":
        from tactbench.core.leaderboard.terminal import plain_text

        _put(plain_text(table, width_without_terminal()).encode("utf-8", "backslashreplace"), to)
    else:
        from tactbench.core.leaderboard.formats import TEXTS

        with collector_at_rest():
            text = TEXTS[shape](table)
        _put(text.encode("utf-8", "replace"), to)


def _put(content: bytes, to: Path | None) -> None:
    from tactbench.core.errors import UsageError
    from tactbench.core.matrix.files import replace_file

    if to is None:
        click.echo(content, nl=False)
        return
    try:
        replace_file(to, content)
    except OSError as error:
        raise UsageError(f"{to} cannot be written: {error.strerror or error}.", hint="Give another file.") from error
