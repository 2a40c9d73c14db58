"""Carrying out one draw: record every scene, answer every question, read off every number."""

from __future__ import annotations

import json
import tempfile
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from tactbench.core.acquisition import acquire
from tactbench.core.calibration.draw import Draw, parameters_of
from tactbench.core.calibration.placing import procedures, simulation_of
from tactbench.core.calibration.readoff import read_off, thinned
from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.evaluation.cell import CellContext, CellResult, evaluate
from tactbench.core.evaluation.dataset import Dataset, load_dataset
from tactbench.core.matrix.installed import rig_of
from tactbench.core.plugins.interfaces import Rig
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.spec.calibration import CalibrationSpec, Output
from tactbench.core.spec.task import PlannedScene, TaskSpec, in_drawn_order


@dataclass(frozen=True)
class Trial:
    """One draw to be carried out; travels to other processes."""

    spec: CalibrationSpec
    seed: int
    number: int
    scratch: Path
    """Folder for recordings while they are needed; whoever ends the process empties it."""


def carry_out(trial: Trial) -> tuple[Draw, float]:
    """Return the draw and the seconds of processor time it took; what goes wrong in it is its reason, never raised."""
    began = time.process_time()
    seed, values = parameters_of(trial.spec, trial.seed, trial.number)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # estimators' are counted by the cell; nobody reads a thousand of them
            outputs = simulated_outputs(trial, seed, values)
    except Exception as error:
        reason = str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {error}"
        return Draw(trial.number, seed, values, {}, "failed", reason), time.process_time() - began
    return Draw(trial.number, seed, values, outputs), time.process_time() - began


def simulated_outputs(trial: Trial, seed: int, values: dict[str, float]) -> dict[str, float]:
    """Return every output of one draw; the recordings are gone afterwards."""
    registry, spec = installed(), trial.spec
    outputs = [output for output in spec.outputs if output.only_first is None or trial.number < output.only_first]
    found: dict[str, float] = {}
    for sensor, task_name in dict.fromkeys((output.sensor, output.task) for output in outputs):
        task = registry.tasks[task_name].spec
        with tempfile.TemporaryDirectory(dir=trial.scratch) as folder:
            paths = _record(trial, registry, sensor, task, seed, values, Path(folder))
            data = load_dataset(task, paths)
        own = [output for output in outputs if (output.sensor, output.task) == (sensor, task_name)]
        found.update(_answer(own, spec.protocol, registry, task, data, seed))
    return {output.name: found[output.name] for output in outputs}


def scenes_of(
    spec: CalibrationSpec, sensor: str, task: TaskSpec, values: dict[str, float], seed: int
) -> list[PlannedScene]:
    """Return the task's scenes with the drawn values in their places, in the order that belongs to the draw's seed."""
    found = []
    simulation = simulation_of(spec, sensor, values)
    for planned in in_drawn_order(task.scenes, seed):
        found.append(planned.model_copy(update={"scene": planned.scene.simulated_as(simulation)}))
    return found


def checked(spec: CalibrationSpec) -> None:
    """Look at everything a spec names before anything is simulated.

    Raises
    ------
    UnknownNameError, UsageError
        If a sensor, task, estimator, rig or parameter is not there, or the rig is not a simulated one.
    """
    registry = installed()
    if not registry.rigs[spec.rig].simulated:
        raise UsageError(
            f"The rig {spec.rig!r} is not simulated: nothing can be drawn for it.", hint="Name one in `rig:`."
        )
    seed, values = parameters_of(spec, spec.seed, 0)
    for output in spec.outputs:
        sensor, task = registry.sensors[output.sensor].name, registry.tasks[output.task].spec
        registry.estimators[output.estimator.name]
        if not task.scenes:
            raise UsageError(f"Task {task.name!r} plans no scenes.", hint="Name another in `outputs:`.")
        scenes_of(spec, sensor, task, values, seed)
    known = {output.sensor for output in spec.outputs}
    for nuisance in spec.nuisances:
        for sensor in nuisance.sensors:
            if sensor not in known:
                raise UsageError(
                    f"The nuisance {nuisance.name!r} is of sensor {sensor!r}, which no output asks.",
                    hint=f"Sensors with outputs: {', '.join(sorted(known))}.",
                )
    for setting in procedures(spec):
        checked(setting)


def _record(
    trial: Trial, registry: Registry, sensor: str, task: TaskSpec, seed: int, values: dict[str, float], folder: Path
) -> list[Path]:
    rig = _rig(trial.spec.rig, registry)
    paths = []
    for planned in scenes_of(trial.spec, sensor, task, values, seed):
        scene = planned.scene
        path = folder / f"{scene.name}.h5"
        acquire(
            rig, registry.sensors[sensor], registry.rigs[trial.spec.rig], scene, role=planned.role, seed=seed,
            path=path, clock=time.process_time, provenance={},
        )  # fmt: skip
        paths.append(path)
    return paths


def _rig(name: str, registry: Registry) -> Rig:
    rig = rig_of(name, registry)
    if not hasattr(rig, "open"):
        raise UsageError(f"The rig {name!r} carries out no scenes.", hint="Name a simulated one in `rig:`.")
    return cast(Rig, rig)


def _answer(
    outputs: Sequence[Output], protocol: str, registry: Registry, task: TaskSpec, data: Dataset, seed: int
) -> Iterable[tuple[str, float]]:
    """Yield (name, number) of every output; outputs that read different numbers off one answer share it."""
    answers: dict[str, CellResult] = {}
    for output in outputs:
        key = json.dumps([output.estimator.model_dump(), output.every], sort_keys=True)
        if key not in answers:
            answers[key] = evaluate(
                CellContext(
                    task,
                    registry.estimators[output.estimator.name],
                    output.estimator.params,
                    protocol,
                    None,
                    seed=seed,
                    clock=time.perf_counter,
                    latency=False,
                ),
                thinned(data, output.every),
            )
        yield output.name, read_off(output, answers[key], data.metas)
