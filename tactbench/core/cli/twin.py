"""``tactbench twin``: what the simulated rig would do and why, and whether it is right."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import EFFECTS, format_option

if TYPE_CHECKING:
    from tactbench.core.matrix.store import Row
    from tactbench.core.plugins.interfaces import Explained, Explaining, Verdict
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene, Simulation

_SCORES = ("effects", "estimator", "metric", "unit", "score", "sim_s", "reason")
_EFFECTS = ("included", "effect", "cost_ms", "change", "unit", "reason")


@click.group(name="twin")
def command() -> None:
    """Explain and verify the simulated rig."""


@command.command(name="explain")
@click.option("--sensor", "sensor_name", required=True, metavar="NAME", help="Sensor.")
@click.option("--task", "task_name", required=True, metavar="NAME", help="Task whose scenes are planned.")
@click.option("--rounds", type=click.IntRange(min=0), default=5, show_default=True, metavar="N",
              help="Recordings to time each effect with; 0: the plan alone, no times and score.")  # fmt: skip
@EFFECTS
@format_option("table", "json", "csv")
def explain(sensor_name: str, task_name: str, rounds: int, effects: str | None, shape: str) -> None:
    """Show which effects a task's scenes get, which they do not, why, and what each costs or would cost.

    It ends with the task's score with the effects chosen beside that with all of them.
    """
    from tactbench.core.cli.grid import print_records
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.plugins.rigs import rig_context
    from tactbench.core.study.simulation import simulation_of
    from tactbench.core.tables.terminal import remark

    registry = load_registry()
    rig_name = registry.first_rig("simulated")
    simulation = simulation_of(registry, rig_name, [sensor_name], effects)
    sensor = registry.sensors[sensor_name]
    rig: Explaining = load_object(registry.rigs[rig_name].where)(rig_context(registry))
    if not hasattr(rig, "explain"):
        raise UsageError(f"The rig {rig_name!r} does not explain its plans.", hint="Use the rig twin.")
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
        found = [_effect(row) for row in rig.explain(sensor, group[0], rounds=rounds)]
        if shape == "table":
            kinds = ["" if one["included"] else "skipped" for one in found]
            title = f"{sensor_name}, {task_name}: {group[0].name}, {len(group)} scenes with these effects"
            print_records(found, shape, title=title, columns=_EFFECTS, kinds=kinds)
        records += [{**about, **one} for one in found]
    scores = _scores(registry, rig_name, sensor_name, task_name, simulation) if rounds else {}
    if shape == "table":
        remark("change: what leaving out an effect changes, about; of an effect left out, at most; 0: exactly nothing.")
        table = [{"effects": name, **row} for name, row in scores.items()]
        print_records(table, shape, title="Score with the effects chosen and with all of them (SIM)", columns=_SCORES)
        return
    for name, one in scores.items():
        more = "" if name == "chosen" else "_all_effects"
        added = {f"score{more}": one["score"], f"sim_s{more}": one["sim_s"], f"score_reason{more}": one["reason"]}
        records = [{**record, **added} for record in records]
    print_records(records, shape)


def _alike(rig: Explaining, sensor: SensorDescriptor, scenes: list[Scene]) -> list[list[Scene]]:
    """Group scenes that are simulated with the same effects."""
    groups: dict[tuple[tuple[str, bool], ...], list[Scene]] = {}
    for scene in scenes:
        plan = tuple((row.entry.effect, row.entry.included) for row in rig.explain(sensor, scene))
        groups.setdefault(plan, []).append(scene)
    return list(groups.values())


def _scores(registry: Registry, rig: str, sensor: str, task: str, simulation: Simulation) -> dict[str, Row]:
    """Return the row of a quick estimator with the effects chosen, and with all of them."""
    from tactbench.core.cost.task_score import quick_estimator, task_score
    from tactbench.core.study.progress import progress

    answerer, everything = quick_estimator(registry, task), {"effects": (*simulation.effects, "+all")}
    variants = {"chosen": simulation, "all": simulation.model_copy(update=everything)}
    with progress() as display:
        return {
            name: task_score(registry, rig, sensor, task, variant, estimator=answerer, progress=display)
            for name, variant in variants.items()
        }


def _effect(row: Explained) -> dict[str, Any]:
    entry, cost_ms = row.entry, None if row.cost_s is None else round(1e3 * row.cost_s, 2)
    return {
        "effect": entry.effect, "included": entry.included, "asked": entry.asked, "reason": entry.reason,
        "change": entry.change, "unit": entry.unit, "cost_ms": cost_ms, "remark": row.remark,
    }  # fmt: skip


@command.command(name="verify")
@format_option("table", "json", "csv")
@click.pass_context
def verify(ctx: click.Context, shape: str) -> None:
    """Compare the simulation with laws and closed forms.

    Exit code 1 if it misses one.
    """
    from tactbench.core.cli.grid import print_records
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.tables.terminal import remark

    registry = load_registry()
    rig = registry.first_rig("simulated")
    where = registry.rigs[rig].verification
    if where is None:
        hint = "See `tactbench show` with its name."
        raise UsageError(f"The rig {rig!r} declares no laws to verify.", hint=hint)
    found: list[Verdict] = list(load_object(where)())
    kinds = ["" if verdict.met else "failed" for verdict in found]
    print_records([_record(verdict) for verdict in found], shape, title=rig, kinds=kinds)
    met = sum(verdict.met for verdict in found)
    remark(f"{met} of {len(found)} within their bounds.")
    ctx.exit(0 if met == len(found) else 1)


def _record(verdict: Verdict) -> dict[str, Any]:
    numbers = {name: float(getattr(verdict, name)) for name in ("found", "expected", "bound")}
    finite = {name: number if math.isfinite(number) else None for name, number in numbers.items()}
    return {"met": verdict.met, "what": verdict.name, **finite, "unit": verdict.unit, "source": verdict.source}
