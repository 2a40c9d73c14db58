"""``tactbench twin explain``: plans as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tactbench.core.cli.grid import print_grid, print_records
from tactbench.core.cli.progress import progress
from tactbench.core.cli.screen import remark
from tactbench.core.cost.task_score import quick_estimator, task_score
from tactbench.core.errors import NotApplicable, UsageError
from tactbench.core.leaderboard.names import METRIC_NAMES
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.spec.scene import Simulation
from tactbench.core.tables.numbers import score_with_unit

if TYPE_CHECKING:
    from tactbench.core.cost.task_score import TaskScore
    from tactbench.core.plugins.interfaces import Explained, Explaining
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene

_COLUMNS = ("", "effect", "cost", "if left out", "reason")
LONGEST_S = 60.0
"""Seconds that recordings may take for the score."""


def print_explanations(
    registry: Registry, rig_name: str, sensor_name: str, task_name: str, simulation: Simulation | None, rounds: int,
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
    if simulation:
        scenes = [scene.simulated_as(simulation) for scene in scenes]
    records: list[dict[str, Any]] = []
    expected_s = 0.0
    for group in _alike(rig, sensor, scenes):
        rows = rig.explain(sensor, group[0], rounds=rounds)
        if shape == "table":
            _print(sensor_name, task_name, group, rows, rounds)
        about = {"sensor": sensor_name, "task": task_name, "scene": group[0].name, "scenes": len(group)}
        records += [{**about, **_record(row)} for row in rows]
        expected_s += 2 * len(group) * sum(row.cost_s or 0.0 for row in rows if row.entry.included)
    if rounds and expected_s > LONGEST_S:
        remark(f"No score: recording the task with the effects chosen and with all would take about {expected_s:.0f} "
               "s. `tactbench run`, without and with --effects +all, does it.")  # fmt: skip
    elif rounds:
        answerer = quick_estimator(registry, task_name)
        with progress() as display:
            asked = simulation or Simulation()
            chosen, every = (
                task_score(registry, rig_name, sensor_name, task_name, variant, estimator=answerer, progress=display)
                for variant in (asked, asked.model_copy(update={"effects": (*asked.effects, "+all")}))
            )
        if shape == "table":
            _print_scores(sensor_name, chosen, every)
        scores = {
            "score": chosen.score, "score_all_effects": every.score, "score_metric": chosen.metric,
            "score_estimator": chosen.estimator, "score_reason": chosen.reason or every.reason, "sim_s": chosen.sim_s,
            "sim_s_all_effects": every.sim_s,
        }  # fmt: skip
        records = [{**record, **scores} for record in records]
    if shape != "table":
        print_records(records, shape)


def _print_scores(sensor: str, chosen: TaskScore, every: TaskScore) -> None:
    """Print the score with the effects chosen beside that with all."""
    lines = [
        {
            "effects": name,
            "score": one.reason if one.score is None else score_with_unit(one.score, one.unit),
            "simulated in": "" if one.sim_s is None else f"{one.sim_s:.2f} s",
        }
        for name, one in (("chosen", chosen), ("all", every))
    ]
    title = f"{sensor}, {chosen.task}: {METRIC_NAMES.get(chosen.metric, chosen.metric)} by {chosen.estimator} (SIM)"
    print_grid(title, tuple(lines[0]), lines, numeric=("score", "simulated in"))


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
    kinds = ["" if row.entry.included else "skipped" for row in rows]
    others = f", and {len(group) - 1} scenes with the same effects" if len(group) > 1 else ""
    print_grid(f"{sensor}, {task}: {group[0].name}{others}", _COLUMNS, lines, numeric=("cost",), kinds=kinds)
    timed = f"Costs: medians of {rounds} recordings; of an effect left out, what it would add. " if rounds else ""
    remark(f"{timed}= 0: exactly nothing; <= at most; ~ about (a standard deviation, a step); ? not known.")


def _change(row: Explained) -> str:
    entry = row.entry
    if entry.change is None:
        return "?" if not entry.included else ""
    if not entry.change:
        return "= 0"
    return f"{'~' if entry.included else '<='} {entry.change:.3g} {entry.unit}"


def _record(row: Explained) -> dict[str, Any]:
    entry = row.entry
    return {
        "effect": entry.effect, "included": entry.included, "asked": entry.asked, "reason": entry.reason,
        "change": entry.change, "unit": entry.unit, "cost_s": row.cost_s, "remark": row.remark,
    }  # fmt: skip
