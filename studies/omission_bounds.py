"""Whether leaving effects out changes no more than the plan says, in random scenes far from the nominal ones.

Each scene is recorded with the effects chosen, with each effect alone whose bound is above zero, with all those
together that are said to change nothing, with all but creep, and with all. The readings before rounding are compared:
every difference has to keep its bound, of several effects the sum of theirs. Half of the scenes press a BioTac, half an
iCub fingertip: caps from 2 mm to flat, off the middle and near the edges, half of them tilted by up to 15 degrees, up
to 12 N, up and down, within a minute to days, with and without an indenter of its own temperature. What
the twin refuses is drawn anew.

Exit status 1 if a bound does not hold.

Usage: OMP_NUM_THREADS=1 python studies/omission_bounds.py [N] [--seed S]
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import (
    ChannelKind,
    ForceRamp,
    Indenter,
    Placement,
    PlanEntry,
    Quantity,
    RigContext,
    Scene,
    SensorDescriptor,
    TactbenchError,
    assumed,
    load_registry,
)
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin.contact.stages import skin_under_load
from tactbench.rigs.twin.planner import carried_out
from tactbench.rigs.twin.rig import Twin, build
from tactbench.rigs.twin.synthesis import Synthesis

SENSORS = ("biotac", "icub")
RADII_MM = (2.0, 2.0, 3.0, 5.0, 10.0, 20.0, 40.0, math.inf)
FORCES_N = (0.5, 2.0, 5.0, 12.0)
LAST = "converter"
"""Compared before rounding: a difference of a thousandth may flip a count."""
ROUNDING = 1e-9
"""Counts by which two runs of the same sum in another order differ: readings are thousands of counts."""


def drawn(sensor: SensorDescriptor, rng: np.random.Generator, number: int) -> Scene:
    """Return a random scene."""
    skin = sensor.spec.skin
    assert skin is not None
    sheet = skin.sheet
    nominal = sensor.spec.parameters
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    x = rng.uniform(low + 1.0, high - 1.0) - nominal["contact_x"].to("mm")
    s = rng.uniform(-0.35, 0.35) * arc - nominal["contact_s"].to("mm")
    tilts = rng.uniform(-15.0, 15.0, 2) * (rng.random() < 0.5)
    radius = float(rng.choice(RADII_MM))
    ends = [0.0, float(rng.choice(FORCES_N))]
    if rng.random() < 0.3:
        ends = [ends[1], float(rng.choice([0.0, *FORCES_N]))]
    duration = 10.0 ** rng.uniform(math.log10(60.0), 5.5)
    core = nominal.get("heater_power")
    degc = None
    if core is not None and rng.random() < 0.4:
        warm = 23.0 + core.to("W") * nominal["heat_resistance"].to("K/W")
        degc = assumed(warm + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-7.0, 1.5), "degC", "drawn")
    kinds: Sequence[ChannelKind] = ("taxel",)
    if core is not None:
        more: tuple[ChannelKind, ...] = ("dc_pressure", "dc_temperature", "ac_temperature")
        kinds = ("taxel", *(kind for kind in more if rng.random() < 0.3))
    return Scene(
        name=f"random-{number}",
        indenter=Indenter(radius=mm(radius) if math.isfinite(radius) else None),
        placement=Placement(x=mm(x), s=mm(s), tilt_x=degrees(tilts[0]), tilt_s=degrees(tilts[1])),
        profile=ForceRamp(
            start=assumed(ends[0], "N", "drawn"),
            end=assumed(ends[1], "N", "drawn"),
            duration=assumed(duration, "s", "drawn"),
            hold=assumed(float(rng.choice([0.0, 0.12])) * duration, "s", "drawn"),
            samples=300,
        ),
        environment=Environment(
            noise_scale=float(rng.choice([0.3, 1.0, 3.0])),
            drift_scale=float(rng.choice([0.0, 1.0])),
            since_power_on=assumed(float(rng.choice([0.0, 3600.0])), "s", "drawn"),
            indenter_temperature=degc,
        ),
        observe=tuple(kinds),
    )


def mm(value: float) -> Quantity:
    """Return millimetres."""
    return assumed(float(value), "mm", "drawn")


def degrees(value: float) -> Quantity:
    """Return degrees."""
    return assumed(float(value), "deg", "drawn")


def recorded(twin: Twin, sensor: SensorDescriptor, scene: Scene, *words: str) -> tuple[Synthesis, Sequence[PlanEntry]]:
    """Return the recording of `scene` before rounding, with effects asked for, and the plan it keeps."""
    asked = scene.model_copy(update={"simulation": Simulation(effects=words)})
    plan = twin.plan(sensor, asked)
    run = carried_out(sensor, asked, 1, replace(plan, stages=tuple(one for one in plan.stages if one.name != LAST)))
    return run, plan.settled(run.settled)


def apart(one: Synthesis, other: Synthesis) -> float:
    """Return the largest difference of any reading, or of the reference force."""
    pairs = [(a.readings, b.readings) for a, b in zip(one.tracks, other.tracks, strict=True)]
    return max(float(np.abs(a - b).max()) for a, b in [*pairs, (one.reference_n, other.reference_n)])


def checked(twin: Twin, sensor: SensorDescriptor, scene: Scene) -> tuple[list[tuple[str, float, float]], float]:
    """Return (effect, what it changes, its bound) of everything left out of `scene`, and its steepest reading."""
    planned, entries = recorded(twin, sensor, scene)
    left_out = [entry for entry in entries if not entry.included]
    bounds = {entry.effect: math.inf if entry.change is None else entry.change for entry in left_out}
    groups = {effect: [effect] for effect, bound in bounds.items() if bound}
    groups["those said to change nothing"] = [effect for effect, bound in bounds.items() if not bound]
    groups["all but creep"] = [effect for effect in bounds if effect != "creep"]
    groups["all"] = list(bounds)
    rows = []
    for name, effects in groups.items():
        other, _ = recorded(twin, sensor, scene, *(f"+{effect}" for effect in effects))
        rows.append((name, apart(planned, other), sum(bounds[effect] for effect in effects)))
    return rows, float(skin_under_load(planned).steepest(0.0, math.inf).max(initial=0.0))


def main() -> int:
    """Draw, record, compare and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenes", nargs="?", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    registry = load_registry()
    twin = build(RigContext(effects=tuple(registry.effects)))
    rng = np.random.default_rng(asked.seed)
    began = time.perf_counter()
    done: Counter[str] = Counter()
    shares: dict[str, list[float]] = {}
    violated: list[str] = []
    refused = bounds = number = 0
    steepest: dict[str, float] = dict.fromkeys(SENSORS, 0.0)
    while done.total() < asked.scenes:
        number += 1
        sensor = registry.sensors[SENSORS[done.total() % len(SENSORS)]]
        scene = drawn(sensor, rng, number)
        try:
            rows, slope = checked(twin, sensor, scene)
        except TactbenchError:
            refused += 1
            continue
        done[sensor.name] += 1
        steepest[sensor.name] = max(steepest[sensor.name], slope)
        for effect, change, bound in rows:
            bounds += 1
            if bound:
                shares.setdefault(effect, []).append(change / bound)
            if change > bound * (1 + 1e-9) + ROUNDING:
                violated.append(f"{sensor.name}, {scene.name}, {effect}: {change:.3g} against {bound:.3g}")
    for line in violated:
        print("violated:", line)
    for effect, own in sorted(shares.items()):
        print(f"{effect}: {len(own)} bounds above zero; of the bound happened at most {max(own):.3f}, in the median "
              f"{statistics.median(own):.2g}")  # fmt: skip
    print("steepest reading: " + ", ".join(f"{name} {slope:.0f} count/N" for name, slope in steepest.items()))
    print(
        f"{done.total()} random scenes ({', '.join(f'{name} {count}' for name, count in done.items())}), seed "
        f"{asked.seed}, {refused} more refused by the twin: {bounds} bounds checked, {len(violated)} violated; "
        f"{time.perf_counter() - began:.0f} s"
    )
    return 1 if violated else 0


if __name__ == "__main__":
    sys.exit(main())
