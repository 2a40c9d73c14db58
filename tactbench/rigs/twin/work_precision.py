"""Work-precision diagram of the twin: error against seconds per recording, for solvers, grids and load tables."""

from __future__ import annotations

import dataclasses
import functools
import math
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tactbench.plugin import (
    ChannelKind,
    FloatArray,
    Indenter,
    Placement,
    RigError,
    Scalar,
    Scene,
    SensorDescriptor,
    assumed,
    load_registry,
)
from tactbench.plugin.simulation import CostJob, CostPoint, CostStudy, EffectDescriptor, FluidBackedShell, rig_context
from tactbench.rigs.twin.contact.pressing import pressed
from tactbench.rigs.twin.contact.stages import forget_tables, read_names, skin_under_load
from tactbench.rigs.twin.fidelity import DEFAULT, RUNGS, Fidelity
from tactbench.rigs.twin.planner import Plan, plan_scene
from tactbench.rigs.twin.preparation import carried_out, prepare

RADII_MM = (5.0, 10.0, 40.0, math.inf)
"""Radii of the indenters: caps from the sharpest to the bluntest, and the flat surface of the force task."""
LOADS = 12
"""Number of loads at which readings are compared, drawn between a load table's nodes, where interpolation errs most."""
GRIDS = (0.5, 0.75, 1.0, 1.5, 2.0)
NODES = (9, 11, DEFAULT.most_nodes, 32)
"""Largest numbers of nodes of the compared load tables; refinement ends earlier if noise hides the remaining error."""
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
            CostJob(
                label,
                functools.partial(_measured, sensor, scenes, family, label, fidelity, truth, rounds),
                _rung(fidelity),
            )
            for family, label, fidelity in _ways(sensor)
        ],
    )


def _ways(sensor: SensorDescriptor) -> Iterator[tuple[str, str, Fidelity]]:
    """Yield family, label and accuracy settings of every point of the diagram."""
    skin = sensor.spec.skin
    assert skin is not None

    def named(family: str, fidelity: Fidelity) -> tuple[str, str, Fidelity]:
        along, across = fidelity.cells(skin.sheet)
        return family, f"{family}, {along} x {across}, up to {fidelity.most_nodes} nodes", fidelity

    # Also for a skin that this rung does not support: its error is a row of the diagram.
    for nodes in NODES[:3]:
        yield named("closed form", dataclasses.replace(RUNGS["closed-form"], most_nodes=nodes))
    for factor in GRIDS:
        for nodes in NODES if factor == 1.0 else NODES[2:]:
            aim = DEFAULT.table_tolerance_factor if nodes <= DEFAULT.most_nodes else 1 / 3
            finer = dataclasses.replace(DEFAULT, cells_factor=factor, table_tolerance_factor=aim)
            yield named("newton", dataclasses.replace(finer, most_nodes=nodes))


def _rung(fidelity: Fidelity) -> str:
    """Return the name of the contact solver with these settings, or an empty string."""
    return next((name for name, own in RUNGS.items() if own == fidelity), "")


def _measured(
    sensor: SensorDescriptor,
    scenes: Mapping[float, tuple[Scene, Plan]],
    family: str,
    label: str,
    fidelity: Fidelity,
    truth: dict[float, FloatArray],
    rounds: int,
) -> list[CostPoint]:
    seconds: list[float] = []
    differences: list[FloatArray] = []
    for radius, (scene, plan) in scenes.items():
        names = read_names(prepare(sensor, scene, 1, plan))
        pressed(prepare(sensor, scene, 1, plan, fidelity), [], fidelity)  # refuses a skin that it does not do at once
        if radius not in truth:
            truth[radius] = _true(sensor, scene, plan, names)
        for _ in range(rounds):
            forget_tables()
            began = time.process_time()
            run = carried_out(sensor, scene, 1, plan, fidelity)
            seconds.append(time.process_time() - began)
        table = skin_under_load(run)
        differences.append(table(_loads()) - table.readings[0] - truth[radius])
    apart = np.concatenate(differences)
    kinds = {channel.name: channel.kind for channel in sensor.spec.channels()}
    settings: dict[str, Scalar] = {
        "family": family,
        "cells_factor": fidelity.cells_factor,
        "nodes": fidelity.most_nodes,
    }
    found = []
    for kind in dict.fromkeys(kinds[name] for name in names):
        own = apart[:, [place for place, name in enumerate(names) if kinds[name] == kind]]
        found.append(
            CostPoint(
                subject=sensor.name,
                observable=kind,
                label=label,
                seconds=statistics.median(seconds),
                error=float(np.sqrt(np.mean(own**2))),
                worst=float(np.abs(own).max()),
                unit=next(channel.unit for channel in sensor.spec.channels(kind)),
                floor=_noise(sensor, kind),
                default=fidelity == DEFAULT,
                rung=_rung(fidelity),
                settings=settings,
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
    return np.asarray(5.0 * np.sort(places), dtype=np.float64)


def _true(sensor: SensorDescriptor, scene: Scene, plan: Plan, names: list[str]) -> FloatArray:
    """Return the (loads, channels) changes from rest with the reference settings, each load solved by itself."""
    run = prepare(sensor, scene, 1, plan, _REFERENCE)
    run.fluid_pressure = "dc_pressure" in scene.observe
    press, read = pressed(run, names, _REFERENCE)
    rest = read(press(0.0))
    return np.stack([read(press(float(load))) - rest for load in _loads()])


def _noise(sensor: SensorDescriptor, kind: ChannelKind) -> float:
    """Return the standard deviation of white noise and rounding of a kind of channel; infinity if both are 0."""
    nuisances = sensor.spec.nuisances.get(kind)
    return math.inf if nuisances is None else nuisances.hidden() or math.inf
