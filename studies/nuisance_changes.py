"""What each nuisance between recordings does to the paper's scores, over seeds.

The BioTac's and the iCub's curvature (macro F1) and force (RMSE, N) under the paper's protocol, every seed with another
unit, placement, noise and order of the caps, for named sets of nuisances: those that the twin once had, then one change
after the other until today's; by name also today's with one change taken back. A set is what the sensors' specs and the
tasks' scenes say today, with the changes of SETS undone where it names them. A line has the median and the range over
seeds of the score, and the median over seeds of its difference from the line it is told against: the same seed has the
same unit, placement and noise in all sets, so that differences scatter less than scores.

Curvature is answered by 200 trees on every fourth row, or by the task's own 500 trees on every row with --full; force
by the Lasso at the paper's lambda of 0.2. Rows are SIM: a set says what the twin does, not what is true of the sensors.

Usage: python studies/nuisance_changes.py [--seeds 20] [--sensor NAME]... [--task NAME]... [--set NAME]... [--full]
       python studies/nuisance_changes.py --warm-up    the warm-up's time constant, recovered from rest levels
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tactbench.core.acquisition import acquire
from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.evaluation.dataset import Dataset, load_dataset
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.spec.scene import Simulation
from tactbench.core.spec.task import PlannedScene, in_drawn_order
from tactbench.plugin import (
    ForceRamp,
    Placement,
    RigContext,
    Scene,
    SensorDescriptor,
    assumed,
    load_object,
    load_registry,
)
from tactbench.plugin.simulation import Nuisances

REGISTRY = load_registry()
RIG = REGISTRY.rigs["twin"]
FIELDS = {
    "levels": ("offset_shared", "offset_own"),
    "field": ("offset_smooth",),
    "wander": ("wander", "wander_tau"),
    "pdc": ("warm_up",),
}
"""Nuisances that a change sets back to those of the scenario hard-handled."""
CHANGES = ("levels", "field", "wander", "pdc", "warm", "order")
"""Offsets of 1 and 2 counts for 15 and 5; own offsets as a smooth field; wander .1 for .5; the warm-up of PDC 20 for
100; an hour since power-on for ten minutes; caps in a drawn order for the declared one."""
SETS: dict[str, tuple[frozenset[str], str]] = {
    "before": (frozenset(CHANGES), ""),
    "+ levels": (frozenset(CHANGES[1:]), "before"),
    "+ field": (frozenset(CHANGES[2:]), "+ levels"),
    "+ wander": (frozenset(CHANGES[3:]), "+ field"),
    "+ pdc": (frozenset(CHANGES[4:]), "+ wander"),
    "+ warm": (frozenset(CHANGES[5:]), "+ pdc"),
    "today": (frozenset(), "+ warm"),
    **{f"today, old {change}": (frozenset({change}), "today") for change in CHANGES},
    "before, new levels and warm": (frozenset(CHANGES) - {"levels", "warm"}, "before"),
    "no offsets": (frozenset({"no offsets"}), "today"),
}
"""By name: the changes that are undone, and the set it is told against. `+ order` is today."""
USUAL = ("before", "+ levels", "+ field", "+ wander", "+ pdc", "+ warm", "today")
COLD_S = 600.0
LOGS, LOGGED_S, LOG_S = 11, 738.0, 2.0
"""Short logs within 12.3 minutes, as the one real BioTac was watched; their length is assumed."""


def sensor_in(name: str, undone: frozenset[str]) -> SensorDescriptor:
    """Return the sensor with the nuisances of a set."""
    sensor = REGISTRY.sensors[name]
    old = sensor.spec.scenarios["hard-handled"].nuisances if "hard-handled" in sensor.spec.scenarios else {}
    nuisances = dict(sensor.spec.nuisances)
    for change in undone & set(FIELDS):
        kind = "dc_pressure" if change == "pdc" else "taxel"
        if kind in old:
            nuisances[kind] = nuisances[kind].model_copy(
                update={field: getattr(old[kind], field) for field in FIELDS[change]}
            )
    if "no offsets" in undone:
        nuisances["taxel"] = _without_offsets(nuisances["taxel"])
    return sensor.model_copy(update={"spec": sensor.spec.model_copy(update={"nuisances": nuisances})})


def _without_offsets(taxel: Nuisances) -> Nuisances:
    none = assumed(0.0, "count", "left out")
    return taxel.model_copy(update={"offset_shared": none, "offset_own": none})


def scenes_in(task: str, undone: frozenset[str], seed: int) -> tuple[PlannedScene, ...]:
    """Return the task's scenes as warm and in the order of a set."""
    planned = REGISTRY.tasks[task].spec.scenes
    if "order" not in undone:
        planned = in_drawn_order(planned, seed)
    if "warm" not in undone:
        return planned
    cold = assumed(COLD_S, "s", "ten minutes")
    return tuple(
        item.model_copy(
            update={
                "scene": item.scene.model_copy(
                    update={"environment": item.scene.environment.model_copy(update={"since_power_on": cold})}
                )
            }
        )
        for item in planned
    )


def thinned(data: Dataset, every: int) -> Dataset:
    """Return every `every`-th row of each recording; rows keep their index."""
    return replace(
        data,
        tables=tuple(
            replace(
                table, X=table.X[::every], y=table.y[::every], labelled=table.labelled[::every],
                force=None if table.force is None else table.force[::every], time_s=table.time_s[::every],
                row=table.row[::every], groups={name: column[::every] for name, column in table.groups.items()},
            )
            for table in data.tables
        ),
    )  # fmt: skip


def score(sensor: str, task: str, undone: frozenset[str], seed: int, *, full: bool, rig: object) -> float:
    """Return the test score of one seed in one set."""
    spec, described = REGISTRY.tasks[task].spec, sensor_in(sensor, undone)
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for item in scenes_in(task, undone, seed):
            path = Path(folder) / f"{item.scene.name}.h5"
            acquire(rig, RecordingRequest(described, RIG, item.scene, path, seed, item.role), clock=time.perf_counter)
            paths.append(path)
        # In the declared order, whatever was recorded first: rows are given to the estimator alike.
        declared = [planned.scene.name for planned in spec.scenes]
        data = load_dataset(spec, sorted(paths, key=lambda path: declared.index(path.stem)))
    if task == "force":
        name, params, every = "lasso", {"lambda_": 0.2}, 1
    else:
        name, params, every = ("forest", {}, 1) if full else ("forest", {"n_estimators": 200}, 4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return evaluate_cell(
            CellContext(spec, REGISTRY.estimators[name], params, "karl2016", None, seed=seed, clock=time.perf_counter),
            thinned(data, every),
        ).score


def warming(t_s: np.ndarray, level: np.ndarray) -> tuple[float, float]:
    """Return (rise still to come at the first sample, time constant [s]) of ``level = a - w exp(-t / tau)``.

    Least squares: for each time constant the other two are linear; the best one by golden section between a twentieth
    and five times the length of the record, beyond which a record cannot tell.
    """
    t = t_s - t_s[0]

    def fit(tau: float) -> tuple[float, float]:
        basis = np.stack([np.ones_like(t), -np.exp(-t / tau)], axis=1)
        found, *_ = np.linalg.lstsq(basis, level, rcond=None)
        return float(np.sum((basis @ found - level) ** 2)), float(found[1])

    low, high = np.log(t[-1] / 20.0), np.log(5.0 * t[-1])
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    for _ in range(60):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if fit(float(np.exp(left)))[0] < fit(float(np.exp(right)))[0]:
            high = right
        else:
            low = left
    tau = float(np.exp((low + high) / 2.0))
    return fit(tau)[1], tau


def time_constants(seeds: Sequence[int], scenario: str | None = None) -> list[float]:
    """Return the time constant [s] fitted to the mean rest levels of the BioTac's logs, by seed.

    Each log is a recording of its own, with its own offsets, from power-on; the fit is :func:`warming`.
    """
    rig, sensor = load_object(RIG.where)(RigContext(effects=tuple(REGISTRY.effects))), REGISTRY.sensors["biotac"]
    starts_s = np.linspace(0.0, LOGGED_S, LOGS)
    why = "a log without contact"
    found = []
    for seed in seeds:
        levels = []
        for number, start_s in enumerate(starts_s):
            scene = Scene(
                name=f"log-{number}",
                placement=Placement(scatter=assumed(0.0, "mm", why)),
                profile=ForceRamp(
                    end=assumed(0.0, "N", why), hold=assumed(0.0, "s", why), duration=assumed(LOG_S, "s", why),
                    samples=round(100 * LOG_S),
                ),
                starts_after_s=float(start_s),
                simulation=Simulation(scenario=scenario),
            )  # fmt: skip
            since = scene.environment.model_copy(update={"since_power_on": assumed(0.0, "s", why)})
            with rig.open(sensor, scene.model_copy(update={"environment": since}), seed=seed) as acquisition:
                levels.append(float(np.mean([b.data.mean() for b in acquisition if b.stream == "electrodes"])))
        found.append(warming(starts_s, np.array(levels))[1])
    return found


def _print_warm_up() -> None:
    print(f"Time constant [s] from the rest levels of {LOGS} logs within {LOGGED_S / 60:.1f} minutes; spec: 500 s")
    for scenario in (None, "hard-handled"):
        found = time_constants(range(1, 17), scenario)
        inside = sum(450 <= tau <= 650 for tau in found)
        spread = f"median {statistics.median(found):.0f} ({min(found):.0f} … {max(found):.0f})"
        print(f"{scenario or 'usual':<13} {inside:2d} of 16 seeds within 450-650 s; {spread}")


def main() -> None:
    """Run the sets and print a table per sensor and task."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--sensor", action="append", choices=("biotac", "icub"))
    parser.add_argument("--task", action="append", choices=("curvature", "force"))
    parser.add_argument("--set", action="append", choices=tuple(SETS), dest="sets")
    parser.add_argument("--full", action="store_true", help="500 trees on every row")
    parser.add_argument("--warm-up", action="store_true")
    asked = parser.parse_args()
    if asked.warm_up:
        _print_warm_up()
        return
    rig = load_object(RIG.where)(RigContext(effects=tuple(REGISTRY.effects)))
    with threadpool_limits(1):
        for sensor in asked.sensor or ("biotac", "icub"):
            for task in asked.task or ("curvature", "force"):
                _print_sets(sensor, task, asked.sets or USUAL, range(1, asked.seeds + 1), asked.full, rig)


def _print_sets(sensor: str, task: str, sets: Sequence[str], seeds: range, full: bool, rig: object) -> None:
    print(f"\n{sensor}, {task}, seeds 1 to {seeds.stop - 1}: median (range); median difference from", flush=True)
    found: dict[str, list[float]] = {}
    known: dict[tuple[str, str, int], float] = {}
    for name in sets:
        undone, against = SETS[name]
        found[name] = []
        for seed in seeds:
            # Sets that differ in nothing that is observed, as most do for the iCub, are one.
            scenes = scenes_in(task, undone, seed)
            nuisances = [sensor_in(sensor, undone).spec.nuisances[kind] for kind in scenes[0].scene.observe]
            key = (str(nuisances), str(scenes), seed)
            if key not in known:
                known[key] = score(sensor, task, undone, seed, full=full, rig=rig)
            found[name].append(known[key])
        values = found[name]
        told = f"{statistics.median(values):.3f} ({min(values):.3f} … {max(values):.3f})"
        if against in found:
            difference = statistics.median(np.subtract(values, found[against]).tolist())
            told += f"   {difference:+.3f} from {against}"
        print(f"  {name:<28} {told}", flush=True)


if __name__ == "__main__":
    main()
