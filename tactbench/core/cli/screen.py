"""Results on stdout, remarks on stderr."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.console import Console

WIDTH_WITHOUT_TERMINAL = 240
"""Wide enough for every column: a file or a pipe has no edge."""


def console() -> Console:
    """Return a console for stdout; without a terminal it is wide, plain and never cuts a table."""
    from rich.console import Console

    if sys.stdout.isatty():
        return Console(highlight=False)
    width = int(os.environ.get("COLUMNS", WIDTH_WITHOUT_TERMINAL))
    return Console(highlight=False, width=max(width, WIDTH_WITHOUT_TERMINAL), color_system=None)


def remark(text: str) -> None:
    """Say something beside the results."""
    click.echo(text, err=True)
