"""How verbs print a leaderboard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import click

TABLE_FORMATS = ("table", "json", "md", "latex", "csv", "html")


def print_rows(rows: Sequence[Mapping[str, Any]], shape: str) -> None:
    """Print `rows` on stdout in one of `TABLE_FORMATS`."""
    if shape == "table":
        from tactbench.core.cli.screen import console
        from tactbench.core.leaderboard.terminal import show

        show(rows, console())
    else:
        from tactbench.core.leaderboard.formats import FORMATS

        click.echo(FORMATS[shape](rows), nl=False)
