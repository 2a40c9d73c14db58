"""``tactbench leaderboard``: the last run's table again."""

from __future__ import annotations

import json
from pathlib import Path

import click

from tactbench.core.cli.comparisons import print_comparisons
from tactbench.core.cli.tables import TABLE_FORMATS, print_rows
from tactbench.core.leaderboard.axes import AXES


@click.command(name="leaderboard")
@click.argument("folder", type=click.Path(path_type=Path), default=Path("tactbench-results"), required=False)
@click.option("--format", "shape", type=click.Choice(TABLE_FORMATS), default="table", show_default=True)
@click.option("--compare", "by", type=click.Choice(AXES), help="Show these side by side instead.")
def command(folder: Path, shape: str, by: str | None) -> None:
    """Show the last run's table again, in any format. FOLDER is what `run --out` wrote."""
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.formats import JSON_KEYS

    path = folder / "leaderboard.json"
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} cannot be read: {error}.", hint="Make one with `tactbench run --out DIR`.") from error
    if not isinstance(rows, list) or not all(isinstance(row, dict) and set(JSON_KEYS) <= set(row) for row in rows):
        raise UsageError(f"{path} is not a leaderboard of this version.", hint="Run `tactbench run` again.")
    if by is None:
        print_rows(rows, shape)
    else:
        print_comparisons(rows, by, shape)
