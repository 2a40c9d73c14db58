"""``tactbench list``: what there is to choose from."""

from __future__ import annotations

import click

from tactbench.core.cli.plugins import tell_failed
from tactbench.core.tables.text import json_text

SCENARIOS = "scenarios"
FAMILIES = ("sensors", "rigs", "devices", "tasks", "estimators", "effects", "indenters", "profiles", SCENARIOS)


@click.command(name="list")
@click.argument("family", type=click.Choice(FAMILIES), required=False)
@click.option("--format", "shape", type=click.Choice(("table", "json")), default="table", show_default=True)
def command(family: str | None, shape: str) -> None:
    """List what is installed: devices are force sensors and motors, scenarios are of sensors."""
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    families = (family,) if family else FAMILIES
    found = {
        name: {
            descriptor.name: getattr(descriptor, "title", None) or descriptor.spec.title
            for descriptor in registry.families()[name]
        }
        for name in families
        if name != SCENARIOS
    }
    if SCENARIOS in families:
        stated = [(name, sensor) for sensor in registry.sensors for name in sensor.spec.scenarios]
        found[SCENARIOS] = {
            name: "; ".join(f"{one.name}: {one.spec.scenarios[name].title}" for also, one in stated if also == name)
            for name, _ in stated
        }
    if shape == "json":
        click.echo(json_text(found, indent=1))
        return
    for name, entries in found.items():
        click.secho(name, bold=True)
        width = max((len(entry) for entry in entries), default=0)
        for entry, title in entries.items():
            click.echo(f"  {entry:<{width}}  {title}")
    tell_failed(registry)
