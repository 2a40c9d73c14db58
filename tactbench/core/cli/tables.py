"""How verbs print a leaderboard, or write it to a file."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

TABLE_FORMATS = ("table", "json", "md", "latex", "csv", "parquet", "html")

Row = Mapping[str, Any]


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


def print_rows(
    rows: Sequence[Row],
    shape: str,
    provenance: Sequence[Row] = (),
    *,
    times: bool = True,
    to: Path | None = None,
    folder: Path | None = None,
) -> None:
    """Print `rows` on stdout, or write them to a file, in one of `TABLE_FORMATS`.

    Parameters
    ----------
    provenance
        What is known of the runs they are from.
    times
        False: only what a seed decides.
    to
        The file to write in place of stdout.
    folder
        The result folder that remembers how rows were ranked.

    Raises
    ------
    UsageError
        If a terminal is asked to show bytes, the page to have no times, or the file cannot be written.
    """
    from tactbench.core.leaderboard import memo
    from tactbench.core.leaderboard.collector import collector_at_rest
    from tactbench.core.leaderboard.table import build_table

    check_destination(shape, to, times=times)
    if folder is not None:
        memo.load(folder)
    table = build_table(rows, provenance, times=times)
    if folder is not None:
        memo.save(folder)
    if shape == "table" and to is None:
        from tactbench.core.cli.screen import console
        from tactbench.core.leaderboard.terminal import show

        show(table, console())
    elif shape == "parquet":
        from tactbench.core.leaderboard.parquet import parquet

        _put(parquet(table), to)
    elif shape == "table":
        from tactbench.core.leaderboard.terminal import plain_text

        _put(plain_text(table).encode(), to)
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
