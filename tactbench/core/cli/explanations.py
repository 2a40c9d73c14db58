"""``tactbench twin explain``: plans as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tactbench.core.cli.grid import print_grid, print_records
from tactbench.core.cli.screen import remark
from tactbench.core.errors import NotApplicable, UnknownNameError, UsageError
from tactbench.core.plugins.interfaces import RigContext
from tactbench.core.plugins.registry import load_object

if TYPE_CHECKING:
    from tactbench.core.plugins.interfaces import Explained, Explaining
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene, Simulation

_COLUMNS = ("", "effect", "cost", "if left out", "reason")


def print_explanations(
    registry: Registry,
    rig_name: str,
    sensor_name: str,
    task_name: str,
    wanted: str | None,
    simulation: Simulation | None,
    rounds: int,
    shape: str,
) -> None:
    """Print the plans of a task's scenes, one table for each different set of effects.

    Raises
    ------
    UsageError
        If a name is unknown, the rig does not explain itself, or the task plans no scenes.
    NotApplicable
        If the rig cannot simulate the sensor in any of the scenes.
    """
    sensor = registry.sensors[sensor_name]
    rig: Explaining = load_object(registry.rigs[rig_name].where)(RigContext(effects=tuple(registry.effects)))
    if not hasattr(rig, "explain"):
        raise UsageError(f"The rig {rig_name!r} does not explain its plans.", hint="Choose another with --rig.")
    scenes = _scenes(registry, task_name, wanted, simulation)
    records: list[dict[str, Any]] = []
    for group in _alike(rig, sensor, scenes):
        rows = rig.explain(sensor, group[0], rounds=rounds)
        if shape == "table":
            _print(sensor_name, task_name, group, rows, rounds)
        records += [_record(sensor_name, task_name, group, row) for row in rows]
    if shape != "table":
        print_records(records, shape)


def _scenes(registry: Registry, task: str, wanted: str | None, simulation: Simulation | None) -> list[Scene]:
    planned = {item.scene.name: item.scene for item in registry.tasks[task].spec.scenes}
    if not planned:
        raise UsageError(
            f"Task {task!r} plans no scenes: only recordings made elsewhere can answer it.",
            hint="Choose another task; see `tactbench list tasks`.",
        )
    if wanted is not None and wanted not in planned:
        raise UnknownNameError(f"scene of task {task!r}", wanted, planned)
    scenes = [planned[wanted]] if wanted is not None else list(planned.values())
    return [scene.model_copy(update={"simulation": simulation}) if simulation else scene for scene in scenes]


def _alike(rig: Explaining, sensor: SensorDescriptor, scenes: list[Scene]) -> list[list[Scene]]:
    """Group scenes by the effects they get."""
    groups: dict[tuple[tuple[str, bool], ...], list[Scene]] = {}
    for scene in scenes:
        plan = tuple((row.entry.effect, row.entry.included) for row in rig.explain(sensor, scene))
        groups.setdefault(plan, []).append(scene)
    if not groups:
        raise NotApplicable(f"The rig simulates none of the scenes with {sensor.name}.")
    return list(groups.values())


def _print(sensor: str, task: str, group: list[Scene], rows: Any, rounds: int) -> None:
    lines = [
        {
            "": "+" if row.entry.included else "-",
            "effect": row.entry.effect,
            "cost": "" if row.cost_s is None else f"{1e3 * row.cost_s:.2f} ms",
            "if left out": _change(row),
            "reason": row.entry.reason + (f" ({row.remark})" if row.remark else ""),
        }
        for row in rows
    ]
    styles = ["" if row.entry.included else "dim" for row in rows]
    others = f", and {len(group) - 1} scenes with the same effects" if len(group) > 1 else ""
    print_grid(f"{sensor}, {task}: {group[0].name}{others}", _COLUMNS, lines, numeric=("cost",), styles=styles)
    included = [row.cost_s for row in rows if row.entry.included and row.cost_s is not None]
    if rounds:
        remark(f"{1e3 * sum(included):.1f} ms for one recording on this machine, medians of {rounds}; behind a minus "
               "stands what asking for the effect would add.")  # fmt: skip
    remark("= 0: exactly nothing; <= x: at most; ~ x: about (a standard deviation, a step); ?: not known.")


def _change(row: Explained) -> str:
    entry = row.entry
    if entry.change is None:
        return "?" if not entry.included else ""
    if not entry.change:
        return "= 0"
    return f"{'~' if entry.included else '<='} {entry.change:.3g} {entry.unit}"


def _record(sensor: str, task: str, group: list[Scene], row: Explained) -> dict[str, Any]:
    return {
        "sensor": sensor,
        "task": task,
        "scene": group[0].name,
        "scenes": len(group),
        "effect": row.entry.effect,
        "included": row.entry.included,
        "asked": row.entry.asked,
        "reason": row.entry.reason,
        "change": row.entry.change,
        "unit": row.entry.unit,
        "cost_s": row.cost_s,
        "remark": row.remark,
    }
