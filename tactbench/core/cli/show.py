"""``tactbench show``: shows sensors side by side, and other installed components field by field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import format_option
from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Owned
    from tactbench.core.spec.sensor import SensorSpec
    from tactbench.core.spec.task import TaskSpec


@click.command(name="show")
@click.argument("names", nargs=-1, required=True)
@click.option("--all", "everything", is_flag=True,
              help="Show every parameter of a sensor and its source.")  # fmt: skip
@format_option("table", "json")
def command(names: tuple[str, ...], everything: bool, shape: str) -> None:
    """Show sensors side by side (Table I and data sheets), or details of other installed components."""
    from tactbench.core.errors import UnknownNameError
    from tactbench.core.plugins.registry import load_registry, plain

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
    from tactbench.core.cli.grid import field_text, print_fields, print_tables
    from tactbench.core.spec.rig import TaskDescriptor
    from tactbench.core.spec.row import lower_is_better
    from tactbench.core.tables.text_table import text_table

    lines: list[tuple[str, ...]]
    one = owned.descriptor
    stated = one.spec if isinstance(one, TaskDescriptor) else one
    fields = [(type(one).__name__.removesuffix("Descriptor").lower(), one.name), ("brought by", _owner(owned))]
    fields += [(name.replace("_", " "), field_text(value)) for name, value in stated if name not in _HIDDEN]
    if isinstance(one, TaskDescriptor):
        fields.append(("better", "lower" if lower_is_better(stated.metric) else "higher"))
        fields.append(("recordings", "" if stated.scenes else "made elsewhere: run --rig replay --recordings DIR"))
        title, lines = "Recordings", [_OF_SCENES, *_scenes(stated)]
    else:
        parameters = getattr(one, "dimensions", getattr(one, "parameters", {}))
        lines = [("parameter", "default", "unit", "range", "meaning")]
        lines += [(name, f"{p.default:g}", p.unit, p.range, p.text) for name, p in parameters.items()]
        title = f"Given as {one.name}:NAME=VALUE,…"
    print_fields([(name, text) for name, text in fields if text])
    click.echo()
    if lines[1:]:
        print_tables([text_table(title, lines[0], lines[1:], numeric=("default", "scenes", "places"))])
        click.echo()


_OF_SCENES = ("role", "scenes", "indenter", "places", "force up to", "slides at", "duration")


def _scenes(task: TaskSpec) -> list[tuple[str, ...]]:
    """Return one table line for all scenes with the same role and duration."""
    from tactbench.core.leaderboard.names import grouped

    lines: list[tuple[str, ...]] = []
    groups = grouped(task.scenes, lambda planned: (str(planned.role), str(planned.scene.profile.duration)))
    for (role, duration), several in groups.items():
        scenes = [planned.scene for planned in several]
        indenters = dict.fromkeys(str(scene.indenter) for scene in scenes)
        places = {(str(scene.placement.x), str(scene.placement.s)) for scene in scenes}
        forces = dict.fromkeys(f"{scene.profile.largest_n:g}" for scene in scenes)
        slides = dict.fromkeys(str(scene.slide.speed) for scene in scenes if scene.slide)
        lines.append((role, str(len(scenes)), ", ".join(indenters), str(len(places)), f"{', '.join(forces)} N",
                      ", ".join(slides), duration))  # fmt: skip
    return lines


def _sensors(sensors: list[SensorSpec], everything: bool) -> None:
    from tactbench.core.cli.grid import print_tables
    from tactbench.core.report.datasheet import data_sheets, quantities, readings, sensor_table, table_one

    tables = {
        "Sensor comparison (Table I of Karl et al. 2016)": table_one(sensors), "Data sheet": data_sheets(sensors),
        "Readings": readings(sensors), "Parameters": quantities(sensors) if everything else {},
    }  # fmt: skip
    shown = [sensor_table(title, sensors, rows, with_source=everything) for title, rows in tables.items() if rows]
    print_tables(shown)
    if not everything:
        click.echo("Give --all to show every parameter with its source.")
