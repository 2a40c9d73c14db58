"""``tactbench twin explain``: plans as tables."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from tactbench.core.cli.grid import print_records
from tactbench.core.cost.task_score import quick_estimator, task_score
from tactbench.core.errors import NotApplicable, UsageError
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.rigs import rig_context
from tactbench.core.study.progress import progress
from tactbench.core.tables.terminal import remark

if TYPE_CHECKING:
    from tactbench.core.cost.task_score import TaskScore
    from tactbench.core.plugins.interfaces import Explained, Explaining
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene, Simulation

_COLUMNS = ("included", "effect", "cost_ms", "change", "unit", "reason")


def print_explanations(
    registry: Registry, rig_name: str, sensor_name: str, task_name: str, simulation: Simulation, rounds: int,
    shape: str,
) -> None:  # fmt: skip
    """Print the plans of a task's scenes, one table for each different set of effects, and what they do to the score.

    Parameters
    ----------
    rounds
        Recordings that each effect is timed with; 0: no times, and no score.

    Raises
    ------
    UsageError
        If a name is unknown, the rig does not explain itself, or the task plans no scenes.
    NotApplicable
        If the rig cannot simulate the sensor in any of the scenes.
    """
    sensor = registry.sensors[sensor_name]
    rig: Explaining = load_object(registry.rigs[rig_name].where)(rig_context(registry))
    if not hasattr(rig, "explain"):
        raise UsageError(f"The rig {rig_name!r} does not explain its plans.", hint="Ask twin.")
    scenes = [planned.scene for planned in registry.tasks[task_name].spec.scenes]
    if not scenes:
        raise UsageError(
            f"Task {task_name!r} plans no scenes: only recordings made elsewhere can answer it.",
            hint="Choose another task; see `tactbench list tasks`.",
        )
    scenes = [scene.simulated_as(simulation) for scene in scenes]
    records: list[dict[str, Any]] = []
    for group in _alike(rig, sensor, scenes):
        about = {"sensor": sensor_name, "task": task_name, "scene": group[0].name, "scenes": len(group)}
        found = [_record(row) for row in rig.explain(sensor, group[0], rounds=rounds)]
        if shape == "table":
            kinds = ["" if one["included"] else "skipped" for one in found]
            title = f"{sensor_name}, {task_name}: {group[0].name}, {len(group)} scenes with these effects"
            costs = [None if row["cost_s"] is None else round(1e3 * row["cost_s"], 2) for row in found]
            lines = [{**row, "cost_ms": cost} for row, cost in zip(found, costs, strict=True)]
            print_records(lines, shape, title=title, columns=_COLUMNS, kinds=kinds)
        records += [{**about, **one} for one in found]
    scores: dict[str, TaskScore] = {}
    if rounds:
        answerer, everything = quick_estimator(registry, task_name), {"effects": (*simulation.effects, "+all")}
        variants = {"chosen": simulation, "all": simulation.model_copy(update=everything)}
        with progress() as display:
            for name, variant in variants.items():
                scores[name] = task_score(
                    registry, rig_name, sensor_name, task_name, variant, estimator=answerer, progress=display
                )
    if shape == "table":
        remark("change: what leaving out an effect changes, about; of an effect left out, at most; 0: exactly nothing.")
        table = [{"effects": name, **asdict(one)} for name, one in scores.items()]
        print_records(table, shape, title="Score with the effects chosen and with all of them (SIM)")
        return
    for name, one in scores.items():
        more = "" if name == "chosen" else "_all_effects"
        added = {f"score{more}": one.score, f"sim_s{more}": one.sim_s, f"score_reason{more}": one.reason}
        records = [{**record, **added} for record in records]
    print_records(records, shape)


def _alike(rig: Explaining, sensor: SensorDescriptor, scenes: list[Scene]) -> list[list[Scene]]:
    """Group scenes by the effects they get."""
    groups: dict[tuple[tuple[str, bool], ...], list[Scene]] = {}
    for scene in scenes:
        plan = tuple((row.entry.effect, row.entry.included) for row in rig.explain(sensor, scene))
        groups.setdefault(plan, []).append(scene)
    if not groups:
        raise NotApplicable(f"The rig simulates none of the scenes with {sensor.name}.")
    return list(groups.values())


def _record(row: Explained) -> dict[str, Any]:
    entry = row.entry
    return {
        "effect": entry.effect, "included": entry.included, "asked": entry.asked, "reason": entry.reason,
        "change": entry.change, "unit": entry.unit, "cost_s": row.cost_s, "remark": row.remark,
    }  # fmt: skip
