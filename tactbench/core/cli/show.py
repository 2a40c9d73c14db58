"""``tactbench show``: specs side by side."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.leaderboard.datasheet import Comparison
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.sensor import SensorSpec


@click.command(name="show")
@click.argument("names", nargs=-1, required=True)
@click.option("--all", "everything", is_flag=True, help="Every parameter, and who states it.")
@click.option("--format", "shape", type=click.Choice(("table", "json", "md")), default="table", show_default=True)
def command(names: tuple[str, ...], everything: bool, shape: str) -> None:
    """Show sensors side by side (the paper's Table I), or a task, rig or estimator."""
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    if shape == "md" and not all(name in registry.sensors for name in names):
        raise UsageError("Only sensors can be shown as Markdown.", hint="Leave --format out, or take --format json.")
    if all(name in registry.sensors for name in names):
        _sensors([registry.sensors[name].spec for name in names], everything, shape)
        return
    shelves = [shelf for shelf in registry.shelves().values() for name in names if name in shelf]
    for name in names:
        if not any(name in shelf for shelf in shelves):
            known = [known for shelf in registry.shelves().values() for known in shelf.names()]
            raise UnknownNameError("sensor, rig, task, estimator or effect", name, known)
    found = [shown for name in names for shown in _described(name, registry)]
    click.echo(json.dumps(found[0] if len(found) == 1 else found, indent=1, ensure_ascii=False))


def _described(name: str, registry: Registry) -> list[dict[str, Any]]:
    """Return what is installed under `name`, one description for each kind of plugin that has it."""
    owners = [shelf.owned(name) for shelf in registry.shelves().values() if name in shelf]
    return [
        {
            "brought by": f"{owned.distribution} {owned.version} ({owned.module})",
            **owned.descriptor.model_dump(mode="json"),
        }
        for owned in owners
    ]


def _sensors(sensors: list[SensorSpec], everything: bool, shape: str) -> None:
    from tactbench.core.leaderboard.datasheet import details, parameters_markdown, table_one

    if shape == "json":
        click.echo(json.dumps([sensor.model_dump(mode="json") for sensor in sensors], indent=1, ensure_ascii=False))
        return
    if shape == "md":
        click.echo(parameters_markdown(sensors), nl=False)
        return
    rows = table_one(sensors)
    _grid("Sensor comparison (Table I of Karl et al. 2016)", sensors, rows, with_source=everything)
    more = details(sensors)
    if everything:
        _grid("Everything the specs state", sensors, more, with_source=True)
    else:
        _grid("Readings", sensors, more[:6], with_source=False)
        tags = [fact.tag for row in more + rows for fact in row.facts if fact.tag]
        counted = ", ".join(f"{tags.count(tag)} {tag}" for tag in ("sourced", "measured", "derived", "assumed"))
        click.echo(f"Facts behind these sensors: {counted}. See them all with --all.")


def _grid(title: str, sensors: list[SensorSpec], rows: list[Comparison], *, with_source: bool) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from tactbench.core.cli.screen import console

    grid = Table(title=Text(title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    grid.add_column("")
    for sensor in sensors:
        grid.add_column(Text(sensor.title), overflow="fold")
        if with_source:
            grid.add_column("source", style="dim", overflow="fold")
    for row in rows:
        cells = []
        for fact in row.facts:
            cells.append(Text(fact.text))
            if with_source:
                cells.append(Text(f"{fact.tag}: {fact.reference}" if fact.tag else ""))
        grid.add_row(Text(row.title), *cells)
    console().print(grid)
