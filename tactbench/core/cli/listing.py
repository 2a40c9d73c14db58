"""``tactbench list``: lists the installed sensors, tasks, estimators and so on, and plugins that failed to load."""

from __future__ import annotations

from typing import Any

import click

from tactbench.core.cli.shared import format_option, print_fields, print_records
from tactbench.core.plugins.registry import Registry, load_registry
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import json_text

PLUGINS = "plugins"
FAMILIES = ("sensors", "rigs", "devices", "tasks", "estimators", "effects", "indenters", "profiles")


@click.command(name="list")
@click.argument("family", type=click.Choice((*FAMILIES, PLUGINS)), required=False)
@format_option("table", "json")
@click.pass_context
def command(ctx: click.Context, family: str | None, shape: str) -> None:
    """List the installed components and plugins.

    Devices are force sensors and motors. `plugins` lists installed plugins, with the reason if one could not be used;
    the exit code is then 1.
    """
    registry = load_registry()
    if family == PLUGINS:
        _plugins(registry, shape)
        ctx.exit(1 if registry.failures or registry.refused else 0)
    found = {name: _titles(registry, name) for name in ((family,) if family else FAMILIES)}
    if shape == "json":
        click.echo(json_text(found, indent=1))
        return
    for name, entries in found.items():
        click.secho(name, bold=True)
        print_fields([(f"  {entry}", title) for entry, title in entries.items()])
    remark_failed(registry)


def _titles(registry: Registry, family: str) -> dict[str, str]:
    members: Any = registry.families()[family]
    return {one.name: getattr(one, "title", None) or one.spec.title for one in members}


def _plugins(registry: Registry, shape: str) -> None:
    refused = [str(error) for error in registry.refused]
    if shape == "json":
        click.echo(json_text({"plugins": [row._asdict() for row in registry.plugins], "refused": refused}, indent=1))
        return
    rows = sorted(registry.plugins, key=lambda row: row.status == "loaded")
    records = [
        {"plugin": row.entry_point, "status": row.status, "distribution": f"{row.distribution} {row.version}",
         "brings": ", ".join(row.brings) if row.status == "loaded" else row.reason}
        for row in rows
    ]  # fmt: skip
    print_records(records, "table", title="plugins", kinds=["" if row.status == "loaded" else "failed" for row in rows])
    for text in refused:
        click.secho(text, fg="red")


def remark_failed(registry: Registry) -> None:
    """Print the names of plugins that could not be loaded, if any, on stderr."""
    if registry.failures or registry.refused:
        names = [row.entry_point for row in registry.failures] + [error.message for error in registry.refused]
        remark(f"Some plugins could not be used: {'; '.join(names)}. See `tactbench list plugins`.")
