"""What the effects of a plan cost on this machine: carried out and timed, those left out included."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence

from tactbench.plugin import IndenterDescriptor, Scene, SensorDescriptor, TactbenchError
from tactbench.plugin.simulation import EffectDescriptor, Explained
from tactbench.rigs.twin.contact.stages import forget_tables
from tactbench.rigs.twin.fidelity import DEFAULT
from tactbench.rigs.twin.planner import LENT, Plan, plan_scene
from tactbench.rigs.twin.preparation import carried_out
from tactbench.rigs.twin.synthesis import Synthesis

_SEED = 1
"""Costs do not depend on what is drawn."""


def explained(
    effects: Sequence[EffectDescriptor],
    indenters: Sequence[IndenterDescriptor],
    sensor: SensorDescriptor,
    scene: Scene,
    plan: Plan,
    rounds: int,
) -> list[Explained]:
    """Return the plan's entries with the median cost of each effect over `rounds` recordings.

    An effect left out is asked for, alone, and timed in the same way: that is what ``+effect`` would cost.
    """
    if not rounds:
        return [Explained(entry, None) for entry in plan.entries]

    def carry_out(plan: Plan) -> Synthesis:
        return carried_out(sensor, scene, _SEED, plan, DEFAULT, indenters)

    carry_out(plan)
    runs = []
    for _ in range(rounds):
        forget_tables()
        runs.append(carry_out(plan))
    lent = {effect.name for effect in effects if LENT in effect.produces}
    rows = []
    for entry in plan.settled(runs[-1].settled):
        if entry.effect in lent:
            rows.append(Explained(entry, None, "part of the contact" if entry.included else ""))
        elif entry.included:
            rows.append(Explained(entry, statistics.median(run.spent_s[entry.effect] for run in runs)))
        else:
            rows.append(Explained(entry, *_if_asked_for(effects, sensor, scene, entry.effect, rounds, carry_out)))
    forget_tables()  # the next recording of the scene solves its contact itself
    return rows


def _if_asked_for(
    effects: Sequence[EffectDescriptor],
    sensor: SensorDescriptor,
    scene: Scene,
    name: str,
    rounds: int,
    carry_out: Callable[[Plan], Synthesis],
) -> tuple[float | None, str]:
    """Return what `name` would cost, or None and why it cannot be asked for."""
    asked = (*scene.simulation.effects, f"+{name}")
    simulation = scene.simulation.model_copy(update={"effects": asked})
    try:
        plan = plan_scene(effects, scene.model_copy(update={"simulation": simulation}), sensor.spec)
        carry_out(plan)
        spent = [carry_out(plan).spent_s[name] for _ in range(rounds)]
    except TactbenchError as error:
        return None, f"cannot be asked for here: {error}"
    return statistics.median(spent), ""
