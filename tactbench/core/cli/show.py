"""``tactbench show``: shows sensors side by side, and other installed components field by field."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from tactbench.core.cli.shared import field_text, format_option, print_fields, print_records, print_tables
from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.names import grouped
from tactbench.core.plugins.registry import Owned, load_registry, plain
from tactbench.core.report.datasheet import data_sheet, quantities, readings, sensor_table, table_one
from tactbench.core.spec.rig import TaskDescriptor
from tactbench.core.spec.row import lower_is_better
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import TaskSpec
from tactbench.core.tables.text import json_text


@click.command(name="show")
@click.argument("names", nargs=-1, required=True)
@click.option("--all", "everything", is_flag=True,
              help="Show every parameter of a sensor and its source.")  # fmt: skip
@format_option("table", "json")
def command(names: tuple[str, ...], everything: bool, shape: str) -> None:
    """Show sensors side by side (Table I and data sheets), or details of other installed components."""
    registry = load_registry()
    families = registry.families()
    for name in names:
        if not any(name in family for family in families.values()):
            raise UnknownNameError("plugin", name, [known for family in families.values() for known in family.names()])
    found = [family.owned(name) for name in names for family in families.values() if name in family]
    sensors = [registry.sensors[name].spec for name in names if name in registry.sensors]
    if shape == "json":
        described = [{"brought by": _owner(owned), **plain(owned.descriptor, "json")} for owned in found]
        click.echo(json_text(described, indent=1))
        return
    if sensors:
        _sensors(sensors, everything)
    for owned in found:
        if owned.descriptor.name not in registry.sensors:
            _page(owned)


def _owner(owned: Owned[Any]) -> str:
    return f"{owned.distribution} {owned.version} ({owned.module})"


_HIDDEN = ("name", "scenes", "campaigns", "published", "dimensions", "parameters")
"""Fields of a descriptor that are printed as separate tables or not at all; JSON output has them."""


def _page(owned: Owned[Any]) -> None:
    """Print the fields of an installed component, and its scenes or parameters as a table."""
    one = owned.descriptor
    stated = one.spec if isinstance(one, TaskDescriptor) else one
    fields = {type(one).__name__.removesuffix("Descriptor").lower(): one.name, "brought by": _owner(owned)}
    fields |= {name.replace("_", " "): value for name, value in stated if name not in _HIDDEN}
    if isinstance(one, TaskDescriptor):
        fields["better"] = "lower" if lower_is_better(stated.metric) else "higher"
        fields["recordings"] = "" if stated.scenes else "made elsewhere: run --rig replay --recordings DIR"
        title, records = "Recordings", list(_scenes(stated))
    else:
        title, records = (
            f"Given as {one.name}:NAME=VALUE,…",
            [
                {"parameter": name, "default": p.default, "unit": p.unit, "range": p.range, "meaning": p.text}
                for name, p in getattr(one, "dimensions", getattr(one, "parameters", {})).items()
            ],
        )
    print_fields([(name, text) for name, value in fields.items() if (text := field_text(value))])
    click.echo()
    if records:
        print_records(records, "table", title=title)
        click.echo()


def _scenes(task: TaskSpec) -> Iterator[dict[str, Any]]:
    """Yield one record for all scenes with the same role and duration."""
    groups = grouped(task.scenes, lambda planned: (str(planned.role), str(planned.scene.profile.duration)))
    for (role, duration), several in groups.items():
        scenes = [planned.scene for planned in several]
        yield {
            "role": role,
            "scenes": len(scenes),
            "indenter": list(dict.fromkeys(str(scene.indenter) for scene in scenes)),
            "places": len({(str(scene.placement.x), str(scene.placement.s)) for scene in scenes}),
            "force up to": f"{', '.join(dict.fromkeys(f'{scene.profile.largest_n:g}' for scene in scenes))} N",
            "slides at": list(dict.fromkeys(str(scene.slide.speed) for scene in scenes if scene.slide)),
            "duration": duration,
        }


def _sensors(sensors: list[SensorSpec], everything: bool) -> None:
    tables = {"Sensor comparison (Table I of Karl et al. 2016)": table_one, "Data sheet": data_sheet,
              "Readings": readings}  # fmt: skip
    if everything:
        tables["Parameters"] = quantities
    print_tables([sensor_table(title, sensors, facts, with_source=everything) for title, facts in tables.items()])
    if not everything:
        click.echo("Give --all to show every parameter with its source.")
