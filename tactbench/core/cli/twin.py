"""``tactbench twin``: shows the effects that the simulated rig includes, and verifies it against closed forms."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import click

from tactbench.core.cli.shared import EFFECTS, format_option, print_records
from tactbench.core.cost.knobs import task_score
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.names import grouped
from tactbench.core.matrix.store import Row
from tactbench.core.plugins.interfaces import Explained, Explaining, Verdict
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.plugins.rigs import rig_context
from tactbench.core.study.options import simulation_of
from tactbench.core.study.terminal import progress
from tactbench.core.tables.terminal import remark

_SCORES = ("effects", "estimator", "metric", "unit", "score", "sim_s", "reason")
_EFFECTS = ("included", "effect", "cost_ms", "change", "unit", "reason")


@click.group(name="twin")
def command() -> None:
    """Explain and verify the simulated rig."""


@command.command(name="explain")
@click.option("--sensor", "sensor_name", required=True, metavar="NAME", help="Sensor.")
@click.option("--task", "task_name", required=True, metavar="NAME", help="Task whose scenes are planned.")
@click.option("--rounds", type=click.IntRange(min=0), default=5, metavar="N",
              help="Number of recordings to time each effect with; 0: the plan alone, no times and score.")  # fmt: skip
@EFFECTS
@format_option("table", "json", "csv")
def explain(sensor_name: str, task_name: str, rounds: int, effects: str | None, shape: str) -> None:
    """Show the effects that are included or left out in simulating a task's scenes, with reasons and cost.

    The last table has the task's score with the effects chosen and with all of them.
    """
    registry = load_registry()
    rig_name = registry.first_rig("simulated")
    simulation = simulation_of(registry, rig_name, [sensor_name], effects)
    sensor = registry.sensors[sensor_name]
    rig: Explaining = load_object(registry.rigs[rig_name].where)(rig_context(registry))
    if not hasattr(rig, "explain"):
        raise UsageError(f"The rig {rig_name!r} cannot list the effects that it includes.", hint="Use the rig twin.")
    scenes = [planned.scene.simulated_as(simulation) for planned in registry.tasks[task_name].spec.scenes]
    if not scenes:
        raise UsageError(
            f"Task {task_name!r} has no scenes to simulate: it is evaluated on recordings made elsewhere.",
            hint="Choose another task; see `tactbench list tasks`.",
        )
    groups = grouped(scenes, lambda scene: tuple(
        (row.entry.effect, row.entry.included) for row in rig.explain(sensor, scene)
    ))  # fmt: skip
    records: list[dict[str, Any]] = []
    for group in groups.values():
        about = {"sensor": sensor_name, "task": task_name, "scene": group[0].name, "scenes": len(group)}
        found = [_effect(row) for row in rig.explain(sensor, group[0], rounds=rounds)]
        records += [{**about, **one} for one in found]
        if shape == "table":
            kinds = ["" if one["included"] else "skipped" for one in found]
            title = f"{sensor_name}, {task_name}: {group[0].name}, {len(group)} scenes with these effects"
            print_records(found, shape, title=title, columns=_EFFECTS, kinds=kinds)
    scores: dict[str, Row] = {}
    with progress() as display:
        for name, more in (("chosen", ()), ("all", ("+all",))) if rounds else ():
            variant = simulation.model_copy(update={"effects": (*simulation.effects, *more)})
            scores[name] = task_score(registry, rig_name, sensor_name, task_name, variant, display)
    if shape == "table":
        remark(
            "change: estimated change if an included effect were left out; for an effect left out, the upper bound of "
            "the change if the effect were included; 0: exactly none."
        )
        table = [{"effects": name, **row} for name, row in scores.items()]
        print_records(table, shape, title="Score with the effects chosen and with all of them (SIM)", columns=_SCORES)
        return
    added = {f"{column}{'' if name == 'chosen' else '_all_effects'}": row[key]
             for name, row in scores.items()
             for column, key in (("score", "score"), ("sim_s", "sim_s"), ("score_reason", "reason"))}  # fmt: skip
    print_records([{**record, **added} for record in records], shape)


def _effect(row: Explained) -> dict[str, Any]:
    cost_ms = None if row.cost_s is None else round(1e3 * row.cost_s, 2)
    return {**row.entry.model_dump(), "cost_ms": cost_ms, "remark": row.remark}


@command.command(name="verify")
@format_option("table", "json", "csv")
@click.pass_context
def verify(ctx: click.Context, shape: str) -> None:
    """Compare the simulation with physical laws and closed forms.

    Exit code 1 if a comparison is outside its bound.
    """
    registry = load_registry()
    rig = registry.first_rig("simulated")
    where = registry.rigs[rig].verification
    if where is None:
        raise UsageError(f"The rig {rig!r} declares no laws to be verified with.", hint="Use the rig twin.")
    found: list[Verdict] = list(load_object(where)())
    kinds = ["" if verdict.met else "failed" for verdict in found]
    print_records(list(map(_record, found)), shape, title=rig, kinds=kinds)
    met = sum(verdict.met for verdict in found)
    remark(f"{met} of {len(found)} comparisons are within their bounds.")
    ctx.exit(0 if met == len(found) else 1)


def _record(verdict: Verdict) -> dict[str, Any]:
    stated = asdict(verdict)
    return {"met": verdict.met, "what": stated.pop("name"), **stated}
