"""``tactbench show``: specs side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import format_option
from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Owned, Registry
    from tactbench.core.spec.sensor import SensorSpec


@click.command(name="show")
@click.argument("names", nargs=-1, required=True)
@click.option("--all", "everything", is_flag=True,
              help="Show every parameter and its source; of a task in JSON every scene of its campaigns.")  # fmt: skip
@format_option("table", "json", "md")
def command(names: tuple[str, ...], everything: bool, shape: str) -> None:
    """Show sensors side by side (Table I and data sheets), or details of anything else that is installed."""
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    families = registry.families()
    for name in names:
        if not any(name in family for family in families.values()):
            known = [known for family in families.values() for known in family.names()]
            raise UnknownNameError("plugin", name, known)
    only_sensors = all(name in registry.sensors for name in names)
    if shape == "md" and not only_sensors:
        raise UsageError("Only sensors can be shown as Markdown.", hint="Leave --format out, or take --format json.")
    if shape == "json" and not only_sensors:
        found = [shown for name in names for shown in _described(name, registry)]
        for shown in found if not everything else ():
            _count_campaigns(shown)
        click.echo(json_text(found[0] if len(found) == 1 else found, indent=1))
        return
    sensors = [registry.sensors[name].spec for name in names if name in registry.sensors]
    if sensors:
        _sensors(sensors, everything, shape)
    if not only_sensors:
        _pages([family.owned(name) for name in names for kind, family in families.items()
                if kind != "sensors" and name in family])  # fmt: skip


def _count_campaigns(shown: dict[str, Any]) -> None:
    """Put the number of scenes in the place of those of each campaign: thousands of lines."""
    campaigns = shown.get("spec", {}).pop("campaigns", None)
    if campaigns:
        shown["spec"]["campaign_scenes"] = {name: len(scenes) for name, scenes in campaigns.items()}


def _described(name: str, registry: Registry) -> list[dict[str, Any]]:
    """Return what is installed under `name`, one description for each kind of plugin that has it."""
    found = []
    for owned in (family.owned(name) for family in registry.families().values() if name in family):
        dumped: dict[str, Any] = owned.descriptor.model_dump(mode="json")
        if hasattr(owned.descriptor, "transducer"):
            dumped["spec"] = _sensor(owned.descriptor.spec)
        found.append({"brought by": _owner(owned), **dumped})
    return found


def _sensor(spec: SensorSpec) -> dict[str, Any]:
    return {**spec.model_dump(mode="json"), "data_sheet": spec.data_sheet.model_dump(mode="json")}


def _owner(owned: Owned[Any]) -> str:
    return f"{owned.distribution} {owned.version} ({owned.module})"


def _pages(owners: list[Owned[Any]]) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from tactbench.core.cli.pages import page_of
    from tactbench.core.cli.screen import console

    screen = console()
    for owned in owners:
        title, sections = page_of(owned.descriptor)
        screen.print(Text(title, style="bold"))
        screen.print(Text(f"brought by {_owner(owned)}", style="dim"))
        for section in sections:
            if section.title:
                screen.print(Text(f"\n{section.title}", style="bold"))
            grid = Table(box=box.SIMPLE_HEAD if section.head else None, show_header=bool(section.head),
                         pad_edge=False, padding=(0, 1))  # fmt: skip
            for place in range(max(map(len, section.lines))):
                name = section.head[place] if section.head else ""
                words = " ".join([name, *(line[place] for line in section.lines)]).split()
                grid.add_column(Text(name), min_width=max(map(len, words), default=1) if section.head else None)
            for line in section.lines:
                grid.add_row(*map(Text, line))
            screen.print(grid)
        screen.print()


def _sensors(sensors: list[SensorSpec], everything: bool, shape: str) -> None:
    from tactbench.core.cli.grid import print_tables
    from tactbench.core.report.datasheet import data_sheets, details, parameters_markdown, sensor_table, table_one

    if shape == "json":
        click.echo(json_text([_sensor(sensor) for sensor in sensors], indent=1))
        return
    if shape == "md":
        click.echo(parameters_markdown(sensors), nl=False)
        return
    rows = table_one(sensors)
    print_tables(
        [sensor_table("Sensor comparison (Table I of Karl et al. 2016)", sensors, rows, with_source=everything)]
    )
    print_tables([sensor_table("Data sheet", sensors, data_sheets(sensors), with_source=everything)])
    rows += data_sheets(sensors)
    more = details(sensors)
    if everything:
        print_tables([sensor_table("Everything the specs state", sensors, more, with_source=True)])
    else:
        print_tables([sensor_table("Readings", sensors, more[:6], with_source=False)])
        tags = [fact.tag for row in more + rows for fact in row.facts if fact.tag]
        counted = ", ".join(f"{tags.count(tag)} {tag}" for tag in ("sourced", "measured", "derived", "assumed"))
        click.echo(f"Facts behind these sensors: {counted}. See them all with --all.")
