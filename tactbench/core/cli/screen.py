"""Results on stdout, remarks on stderr."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.console import Console

WITHOUT_EDGE = 400
"""Width of a table in a file or a pipe, which have no edge: enough for every column of names of ordinary length."""


def console() -> Console:
    """Return a console for stdout; without a terminal it is wide, plain and never cuts a table."""
    from rich.console import Console

    if sys.stdout.isatty():
        return Console(highlight=False)
    return Console(highlight=False, width=WITHOUT_EDGE, color_system=None)


def remark(text: str) -> None:
    """Say something beside the results."""
    from tactbench.core.tables.text import visible_lines

    click.echo(visible_lines(text), err=True)
