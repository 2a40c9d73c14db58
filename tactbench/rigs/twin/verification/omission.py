"""Effects left out change what is observed by no more than the plan says, and by less than noise would hide."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactbench.plugin import FloatArray, PlanEntry, Scene, SensorDescriptor, TactbenchError, load_registry
from tactbench.plugin.simulation import Check, Verdict, rig_context
from tactbench.rigs.twin.fidelity import DEFAULT
from tactbench.rigs.twin.preparation import carried_out
from tactbench.rigs.twin.rig import Twin, build

_LAST = "converter"
"""Compared before rounding: a difference of a thousandth may flip a count."""


def checks() -> Sequence[Check]:
    """Return one check for every installed sensor and task whose scenes the twin can carry out."""
    registry = load_registry()
    twin = build(rig_context(registry))
    assert isinstance(twin, Twin)
    found = []
    for sensor in registry.sensors:
        checked: list[list[Scene]] = []
        for task in registry.tasks:
            scenes = [planned.scene for planned in task.spec.scenes]
            if scenes in checked:  # another task asks of the same recordings
                continue
            checked.append(scenes)
            if any(_simulated(twin, sensor, scene) for scene in scenes):
                found.append(
                    Check(
                        name=f"omission-{sensor.name}-{task.name}",
                        group="omission",
                        title=f"{sensor.name}, {task.name}: all effects against the plan's, over {len(scenes)} scenes",
                        run=functools.partial(_verdicts, twin, sensor, scenes),
                    )
                )
    return found


def difference(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> tuple[float, float, float]:
    """Return what the effects left out change in `scene`, what they may, and what noise hides: counts.

    Returns
    -------
    largest difference of any observed reading between a run with every effect and one with the plan's; the sum of
    the bounds the plan states; the least standard deviation of noise and rounding of an observed kind.
    """
    every = tuple(f"+{effect.name}" for effect in twin.effects if effect.name != _LAST)
    simulation = scene.simulation.model_copy(update={"effects": (*scene.simulation.effects, *every)})
    planned, bound = _readings(twin, sensor, scene)
    all_of_them, _ = _readings(twin, sensor, scene.model_copy(update={"simulation": simulation}))
    largest = max(float(np.abs(a - b).max()) for a, b in zip(planned, all_of_them, strict=True))
    return largest, bound, _hidden(sensor, scene)


def _verdicts(twin: Twin, sensor: SensorDescriptor, scenes: Sequence[Scene]) -> list[Verdict]:
    worst = {"changed": (0.0, 0.0), "hidden": (0.0, math.inf)}
    for scene in scenes:
        if not _simulated(twin, sensor, scene):
            continue
        largest, bound, hidden = difference(twin, sensor, scene)
        # The bounds of a plan and rounding in its last digits: readings are thousands of counts.
        if largest - bound >= worst["changed"][0] - worst["changed"][1]:
            worst["changed"] = (largest, bound + 1e-9)
        if largest / hidden >= worst["hidden"][0] / worst["hidden"][1]:
            worst["hidden"] = (largest, hidden)
    plan_says = "sum of the bounds the plan states for what it leaves out"
    noise_is = "standard deviation of noise and rounding of the quietest observed kind"
    return [
        Verdict("change, against the plan's bound", worst["changed"][0], 0.0, worst["changed"][1], "count", plan_says),
        Verdict("change, against the noise floor", worst["hidden"][0], 0.0, worst["hidden"][1], "count", noise_is),
    ]


def _readings(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> tuple[list[FloatArray], float]:
    plan = twin.plan(sensor, scene)
    stages = tuple(effect for effect in plan.stages if effect.name != _LAST)
    run = carried_out(sensor, scene, 1, replace(plan, stages=stages), DEFAULT, twin.indenters)
    entries = plan.settled(run.settled)
    return [track.readings for track in run.tracks], sum(_bound(entry) for entry in entries)


def _bound(entry: PlanEntry) -> float:
    if entry.included:
        return 0.0
    return math.inf if entry.change is None else entry.change


def _hidden(sensor: SensorDescriptor, scene: Scene) -> float:
    found = [sensor.spec.nuisances[kind] for kind in scene.observe if kind in sensor.spec.nuisances]
    # A sensor without any stated noise hides nothing: its floor says nothing.
    floors = [nuisances.hidden(scene.environment.noise_scale) for nuisances in found]
    return min((floor for floor in floors if floor > 0), default=math.inf)


def _simulated(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> bool:
    try:
        twin.plan(sensor, scene)
    except TactbenchError:
        return False
    return True
