"""Work-precision diagram of the twin: error against seconds per recording, for every contact solver."""

from __future__ import annotations

import functools
import math
import statistics
import time
from collections.abc import Mapping, Sequence

import numpy as np

from tactbench.plugin import (
    ChannelKind,
    FloatArray,
    Indenter,
    Placement,
    RigError,
    Scene,
    SensorDescriptor,
    assumed,
    load_registry,
)
from tactbench.plugin.simulation import CostJob, CostPoint, CostStudy, EffectDescriptor, FluidBackedShell, rig_context
from tactbench.rigs.twin.contact.stages import forget_tables, pressed, read_names, skin_under_load
from tactbench.rigs.twin.planner import Plan, carried_out, plan_scene, prepare
from tactbench.rigs.twin.synthesis import RUNGS

RADII_MM = (5.0, 10.0, 40.0, math.inf)
"""Radii of the indenters: caps from the sharpest to the bluntest, and the flat surface of the force task."""
LOADS = 12
"""Number of loads at which readings are compared, drawn between a load table's nodes, where interpolation errs most."""
_REFERENCE = RUNGS["reference"]


def study(sensor: SensorDescriptor, *, rounds: int = 5) -> CostStudy:
    """Return the jobs that measure the diagram of one sensor; every recording is timed `rounds` times.

    A job raises an error if its contact solver does not support the skin.

    Raises
    ------
    RigError
        If the sensor cannot be simulated.
    """
    if sensor.spec.skin is None or sensor.transducer is None:
        raise RigError(f"{sensor.name} cannot be simulated.", hint="Declare a skin and a transducer in its plugin.")
    effects = rig_context(load_registry()).effects
    scenes = {radius: _planned(sensor, effects, radius) for radius in RADII_MM}
    truth: dict[float, FloatArray] = {}
    caps = ", ".join(f"{radius:g}" for radius in RADII_MM if math.isfinite(radius))
    return CostStudy(
        title=f"error against time per recording (caps of {caps} mm and flat, 5 N, 5000 samples)",
        reference=f"Errors are against the rung 'reference' ({_REFERENCE.cells_factor:g} times as many cells each way, "
        f"no table), at {LOADS} loads for each cap, without noise; times are CPU seconds of one thread, medians of "
        f"{rounds * len(RADII_MM)} whole recordings, nothing kept from the one before.",
        jobs=[
            CostJob(name, functools.partial(_measured, sensor, scenes, name, truth, rounds))
            for name in RUNGS
            if name != "reference"
        ],
    )


def _measured(
    sensor: SensorDescriptor,
    scenes: Mapping[float, tuple[Scene, Plan]],
    rung: str,
    truth: dict[float, FloatArray],
    rounds: int,
) -> list[CostPoint]:
    fidelity = RUNGS[rung]
    seconds: list[float] = []
    differences: list[FloatArray] = []
    for radius, (scene, plan) in scenes.items():
        names = read_names(prepare(sensor, scene, 1, plan))
        pressed(prepare(sensor, scene, 1, plan, fidelity), [], fidelity)  # refuses a skin that it does not do at once
        if radius not in truth:
            # Each load solved by itself.
            press, read = pressed(prepare(sensor, scene, 1, plan, _REFERENCE), names, _REFERENCE)
            truth[radius] = np.stack([read(press(float(load))) - read(press(0.0)) for load in _loads()])
        for _ in range(rounds):
            forget_tables()
            began = time.process_time()
            run = carried_out(sensor, scene, 1, plan, fidelity)
            seconds.append(time.process_time() - began)
        table = skin_under_load(run)
        differences.append(table(_loads()) - table.readings[0] - truth[radius])
    apart = np.concatenate(differences)
    channels = {channel.name: channel for channel in sensor.spec.channels()}
    found = []
    for kind in dict.fromkeys(channels[name].kind for name in names):
        own = apart[:, [place for place, name in enumerate(names) if channels[name].kind == kind]]
        nuisances = sensor.spec.nuisances.get(kind)
        found.append(
            CostPoint(
                subject=sensor.name,
                observable=kind,
                label=rung,
                seconds=statistics.median(seconds),
                error=float(np.sqrt(np.mean(own**2))),
                worst=float(np.abs(own).max()),
                unit=next(channel.unit for channel in sensor.spec.channels(kind)),
                floor=math.inf if nuisances is None else nuisances.hidden() or math.inf,
            )
        )
    return found


def _planned(sensor: SensorDescriptor, effects: Sequence[EffectDescriptor], radius_mm: float) -> tuple[Scene, Plan]:
    present = {channel.kind for channel in sensor.spec.channels()}
    fluid = isinstance(sensor.spec.skin, FluidBackedShell)
    observed: tuple[ChannelKind, ...] = ("taxel", "dc_pressure") if fluid and "dc_pressure" in present else ("taxel",)
    scene = Scene(
        name=f"cost-{radius_mm:g}",
        indenter=Indenter(radius=assumed(radius_mm, "mm", "Karl et al. 2016") if math.isfinite(radius_mm) else None),
        placement=Placement(scatter=assumed(0.0, "mm", "the same contact for every way")),
        observe=observed,
    )
    return scene, plan_scene(effects, scene, sensor.spec)


def _loads() -> FloatArray:
    # The golden ratio's multiples fill an interval evenly and never fall on a table's nodes.
    places = (0.5 + np.arange(1, LOADS + 1) * (math.sqrt(5) - 1) / 2) % 1.0
    return 5.0 * np.sort(places)
