"""``tactbench list``: everything that is installed, and the plugins that could not be loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.grid import print_fields, print_records
from tactbench.core.cli.options import format_option
from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry

SCENARIOS, PLUGINS = "scenarios", "plugins"
FAMILIES = ("sensors", "rigs", "devices", "tasks", "estimators", "effects", "indenters", "profiles", SCENARIOS)


@click.command(name="list")
@click.argument("family", type=click.Choice((*FAMILIES, PLUGINS)), required=False)
@format_option("table", "json")
@click.pass_context
def command(ctx: click.Context, family: str | None, shape: str) -> None:
    """List what is installed.

    Devices are force sensors and motors; scenarios belong to sensors. `plugins` lists installed plugins and why one
    could not be used; its exit code is 1 if one could not.
    """
    from tactbench.core.plugins.registry import load_registry

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
    tell_failed(registry)


def _titles(registry: Registry, family: str) -> dict[str, str]:
    if family != SCENARIOS:
        members: Any = registry.families()[family]
        return {one.name: getattr(one, "title", None) or one.spec.title for one in members}
    found: dict[str, str] = {}
    for sensor in registry.sensors:
        for name, scenario in sensor.spec.scenarios.items():
            before = f"{found[name]}; " if name in found else ""
            found[name] = f"{before}{sensor.name}: {scenario.title}"
    return found


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


def tell_failed(registry: Registry) -> None:
    """Print to stderr which plugins could not be loaded; print nothing if all could."""
    from tactbench.core.tables.terminal import remark

    if registry.failures or registry.refused:
        names = [row.entry_point for row in registry.failures] + [error.message for error in registry.refused]
        remark(f"Some plugins could not be used: {'; '.join(names)}. See `tactbench list plugins`.")
