"""Results on stdout, remarks on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console

WITHOUT_EDGE = 400
"""Wide enough for every column of names of ordinary length."""


def console() -> Console:
    """Return a console for stdout; without a terminal it is wide, plain and never cuts a table."""
    from rich.console import Console

    if sys.stdout.isatty():
        return Console(highlight=False)
    return Console(highlight=False, width=width_without_terminal(), color_system=None)


def width_without_terminal() -> int:
    """Return how wide a table may be in a file or a pipe, which have no edge; wider if ``COLUMNS`` says so."""
    said = os.environ.get("COLUMNS", "")
    return max(int(said) if said.isdecimal() else 0, WITHOUT_EDGE)


def remark(text: str) -> None:
    """Say something beside the results."""
    click.echo(text, err=True)


def print_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], *, whole: str = "") -> None:
    """Print a table under a title to stdout; without rows it says that there are none.

    The column `whole` is not broken: it holds commands to copy.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    screen = console()
    screen.print(Text(title, style="bold"))
    if not rows:
        screen.print("  none\n")
        return
    table: Any = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in head:
        table.add_column(Text(name), overflow="fold", no_wrap=name == whole)
    for row in rows:
        table.add_row(*map(Text, row))
    screen.print(table)
