"""``tactbench rig``: what a rig of real devices would do by its file, without opening or moving anything."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.plugins.checks import RigCheck


@click.group(name="rig")
def command() -> None:
    """Look into rigs of real devices, and their files."""


@command.command(name="check")
@click.argument("rig_file", type=click.Path(path_type=Path), metavar="RIG-FILE")
@click.option("--format", "shape", type=click.Choice(("table", "json")), default="table", show_default=True)
@click.pass_context
def check(ctx: click.Context, rig_file: Path, shape: str) -> None:
    """Say what a rig would do by RIG-FILE, and refuse it if that may do harm; nothing is opened, nothing moves.

    Exit code 1 if the rig refuses the file, 2 if it cannot be read or lacks something.
    """
    from dataclasses import asdict

    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.plugins.rig_files import load_rig_file

    registry = load_registry()
    file = load_rig_file(rig_file, registry)
    where = registry.rigs[file.rig].check
    if where is None:
        raise UsageError(
            f"The rig {file.rig!r} moves nothing, so there is nothing to check beyond its file, which is in order.",
            hint=f"`tactbench doctor --rig-file {rig_file}` asks its devices.",
        )
    found: RigCheck = load_object(where)(file)
    if shape == "json":
        click.echo(json_text(asdict(found), indent=1))
    else:
        _print(found)
    ctx.exit(1 if found.problems else 0)


def _print(found: RigCheck) -> None:
    from tactbench.core.cli.screen import print_table

    for table in found.tables:
        print_table(table.title, table.head, table.rows)
    for text in found.problems:
        click.secho("Refused: ", fg="red", bold=True, nl=False)
        click.echo(text)
    if not found.problems:
        click.echo("Nothing is refused. Nothing was opened, and nothing has moved.")
