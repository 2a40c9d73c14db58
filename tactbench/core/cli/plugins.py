"""``tactbench plugins``: what is installed, and why something could not be used."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry


def tell_failed(registry: Registry) -> None:
    """Say on stderr which plugins could not be used; nothing if all could."""
    from tactbench.core.cli.screen import remark

    if registry.failures or registry.refused:
        names = [row.entry_point for row in registry.failures] + [error.message for error in registry.refused]
        remark(f"Some plugins could not be used: {'; '.join(names)}. See `tactbench plugins`.")


@click.command(name="plugins")
@click.option("--format", "shape", type=click.Choice(("table", "json")), default="table", show_default=True)
@click.pass_context
def command(ctx: click.Context, shape: str) -> None:
    """List plugins, and why one could not be used. Exit code 1 if one could not."""
    from dataclasses import asdict

    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    refused = [str(error) for error in registry.refused]
    if shape == "json":
        click.echo(json.dumps({"plugins": [asdict(row) for row in registry.plugins], "refused": refused}, indent=1))
    else:
        width = max((len(row.entry_point) for row in registry.plugins), default=0)
        for row in registry.plugins:
            brought = ", ".join(row.brings) if row.status == "loaded" else row.reason
            click.secho(f"{row.entry_point:<{width}}  ", nl=False, bold=True)
            click.secho(f"{row.status:<7}", nl=False, fg="green" if row.status == "loaded" else "red")
            click.echo(f"{row.distribution} {row.version}  {brought}")
        for text in refused:
            click.secho(text, fg="red")
    ctx.exit(1 if registry.failures or refused else 0)
