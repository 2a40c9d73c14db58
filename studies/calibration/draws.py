"""One draw: a value for every nuisance, the recordings simulated with them, and the numbers read off the answers."""

from __future__ import annotations

import csv
import hashlib
import json
import math
import tempfile
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.acquisition import acquire
from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.evaluation.cell import Result as CellResult
from tactbench.core.evaluation.dataset import Dataset, Table, load_dataset
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.plugins.registry import installed, load_object
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.scene import NUISANCES, Simulation
from tactbench.core.spec.task import in_drawn_order
from tactbench.core.spec.units import with_unit
from tactbench.plugin import RigContext

Procedure = Mapping[str, Any]
"""The content of ``calibration.yaml``."""
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Draw:
    """One draw that has been carried out."""

    number: int
    seed: int
    """Of all its recordings and estimators."""
    parameters: Mapping[str, float]
    """By nuisance, in the unit of its prior."""
    outputs: Mapping[str, float]
    """By output; those read off the first draws only are missing elsewhere."""


@dataclass(frozen=True)
class Result:
    """A finished calibration."""

    procedure: Procedure
    seed: int
    made_by: Mapping[str, str]
    """Versions and commit."""
    cpu_s: float
    """Processor time of the draws; that of the variations is not in it."""
    draws: tuple[Draw, ...]
    variations: Mapping[tuple[str, int], tuple[Draw, ...]]
    """By name of the variation and place of the setting, from 1: a draw a seed."""


def unit_of(nuisance: Mapping[str, Any]) -> str:
    """Return the unit of a nuisance's prior."""
    return NUISANCES[nuisance.get("sets") or nuisance["name"]][1]


def parameters_of(procedure: Procedure, number: int) -> tuple[int, dict[str, float]]:
    """Return the seed of a draw's recordings and estimators, and its value of every nuisance.

    Each nuisance has a random stream of its own, seeded by its name without the unit: a draw is the same alone and
    among others, and one nuisance more or fewer leaves the other values as they are.
    """
    seed, values = procedure["seed"], {}
    for nuisance in procedure["nuisances"]:
        name, prior = nuisance["name"], nuisance["prior"]
        rng = _generator(seed, number, name.removesuffix(with_unit("", unit_of(nuisance))))
        low, high = prior["low"], prior["high"]
        if prior["kind"] == "log-uniform":
            values[name] = min(max(math.exp(rng.uniform(math.log(low), math.log(high))), low), high)
        else:
            values[name] = float(rng.uniform(low, high))
    return int(_generator(seed, number, "recordings and estimators").integers(2**31)), values


def _generator(seed: int, number: int, name: str) -> np.random.Generator:
    words = np.frombuffer(hashlib.blake2b(name.encode(), digest_size=16).digest(), dtype="<u4")
    return np.random.default_rng(np.random.SeedSequence([seed, number, *(int(word) for word in words)]))


def carry_out(procedure: Procedure, number: int) -> tuple[Draw, float]:
    """Return a draw from the priors, and the processor time it took [s]."""
    seed, values = parameters_of(procedure, number)
    given = [
        (nuisance.get("sets") or nuisance["name"], values[nuisance["name"]], nuisance.get("sensors") or ())
        for nuisance in procedure["nuisances"]
    ]
    outputs = [
        one for one in procedure["outputs"] if one.get("only_first") is None or number < one["only_first"]
    ]  # fmt: skip
    began = time.process_time()
    found = _simulated(procedure, outputs, given, seed)
    return Draw(number, seed, values, found), time.process_time() - began


def carry_out_setting(procedure: Procedure, variation: int, place: int, number: int) -> Draw:
    """Return draw `number` of one setting (`place`, from 1) of a variation: nothing is drawn, the seed alone differs.

    The seeds are those of the draws from the priors, and the same in every setting.
    """
    asked = procedure["variations"][variation]
    seed, _ = parameters_of(procedure, number)
    given = [(one["name"], one["value"], one.get("sensors") or ()) for one in asked["settings"][place - 1]["given"]]
    outputs = [one for one in procedure["outputs"] if one["name"] in asked["outputs"]]
    return Draw(number, seed, {}, _simulated(procedure, outputs, given, seed))


def _simulated(
    procedure: Procedure,
    outputs: Sequence[Mapping[str, Any]],
    given: Sequence[tuple[str, float, Sequence[str]]],
    seed: int,
) -> dict[str, float]:
    """Return the outputs, of recordings with the nuisances `given` as (name, value, sensors); no sensors: all."""
    registry = installed()
    described = registry.rigs[procedure["rig"]]
    rig = load_object(described.where)(RigContext(effects=tuple(registry.effects)))
    found: dict[str, float] = {}
    for sensor, name in dict.fromkeys((one["sensor"], one["task"]) for one in outputs):
        task = registry.tasks[name].spec
        simulation = Simulation(nuisances={name: value for name, value, own in given if not own or sensor in own})
        answers: dict[str, CellResult] = {}
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of estimators that do not converge
            paths = []
            for planned in in_drawn_order(task.scenes, seed):
                path = Path(folder) / f"{planned.scene.name}.h5"
                scene = planned.scene.simulated_as(simulation)
                request = RecordingRequest(registry.sensors[sensor], described, scene, path, seed, planned.role)
                acquire(rig, request, clock=time.process_time)
                paths.append(path)
            data = load_dataset(task, paths)
            for output in outputs:
                if (output["sensor"], output["task"]) != (sensor, name):
                    continue
                estimator, every = output["estimator"], output.get("every", 1)
                key = json.dumps([estimator, every])
                if key not in answers:
                    context = CellContext(
                        task, registry.estimators[estimator["name"]], estimator.get("params") or {},
                        procedure["protocol"], None, seed=seed, clock=time.perf_counter, latency=False,
                    )  # fmt: skip
                    answers[key] = evaluate_cell(context, thinned(data, every))
                found[output["name"]] = read_off(output.get("figure") or {"kind": "score"}, answers[key], data.metas)
    return {one["name"]: found[one["name"]] for one in outputs}


def thinned(data: Dataset, every: int) -> Dataset:
    """Return every `every`-th row of each recording; rows keep their index."""

    def cut(table: Table) -> Table:
        columns = {one.name: getattr(table, one.name) for one in fields(table)}
        rows: dict[str, Any] = {
            name: column[::every] for name, column in columns.items() if isinstance(column, np.ndarray)
        }
        return replace(table, **rows, groups={name: column[::every] for name, column in table.groups.items()})

    return replace(data, tables=tuple(map(cut, data.tables)))


def read_off(figure: Mapping[str, Any], result: CellResult, metas: Sequence[RecordingMeta]) -> float:
    """Return the score, the metric over a band of commanded force, or the white noise of the predictions."""
    answers = result.sets["test"]
    if figure["kind"] == "band":
        # The measured force is too noisy to sort rows by.
        commanded = np.empty(len(answers.row))
        for place in np.unique(answers.recording):
            scene = metas[int(place)].scene
            assert scene is not None, "a simulated recording states its scene"
            here = answers.recording == place
            times = answers.row[here] * (scene.profile.duration.to("s") / scene.profile.samples)
            commanded[here] = np.interp(times, *scene.profile.corners)
        inside = (commanded >= figure["low_n"]) & (commanded < figure["high_n"])
        assert inside.any(), f"no test row from {figure['low_n']} to {figure['high_n']} N"
        return metric_called(result.metric).of(answers.y_true[inside], answers.y_pred[inside], len(result.classes))
    if figure["kind"] == "roughness":
        return roughness(answers.y_pred, answers.recording, figure["lag"])
    return result.score


def roughness(predicted: FloatArray, recording: npt.NDArray[np.int64], lag: int) -> float:
    """Return the white noise of predictions (n,): rms of ``p[i] - 2 p[i+lag] + p[i+2 lag]`` over sqrt(6).

    A straight rise drops out, and the variance of the rest is six times that of one independent error. Rows of
    different recordings are never subtracted.
    """
    bends = []
    for place in np.unique(recording):
        own = predicted[recording == place].astype(np.float64)
        bends.append(own[: -2 * lag] - 2 * own[lag:-lag] + own[2 * lag :])
    return math.sqrt(float(np.mean(np.concatenate(bends) ** 2)) / 6)


def write(result: Result, folder: Path) -> None:
    """Write ``draws.csv``, ``variations.csv`` and ``run.json``; numbers in full."""
    folder.mkdir(parents=True, exist_ok=True)
    parameters = [one["name"] for one in result.procedure["nuisances"]]
    outputs = [one["name"] for one in result.procedure["outputs"]]
    with (folder / "draws.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, ["draw", "seed", *parameters, *outputs], lineterminator="\n")
        table.writeheader()
        table.writerows({"draw": one.number, "seed": one.seed, **one.parameters, **one.outputs} for one in result.draws)
    with (folder / "variations.csv").open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(["variation", "setting", "draw", "seed", "output", "value"])
        for (name, place), draws in result.variations.items():
            for one in draws:
                lines.writerows((name, place, one.number, one.seed, *pair) for pair in one.outputs.items())
    about = {"made_by": result.made_by, "seed": result.seed, "cpu_s": round(result.cpu_s, 1)}
    text = json.dumps({**about, "procedure": result.procedure}, indent=1, ensure_ascii=False)
    (folder / "run.json").write_text(text + "\n", encoding="utf-8")


def read(folder: Path) -> Result:
    """Return what `write` has written."""
    about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    procedure = about["procedure"]
    with (folder / "draws.csv").open(encoding="utf-8", newline="") as file:
        draws = tuple(
            Draw(
                int(line["draw"]),
                int(line["seed"]),
                {one["name"]: float(line[one["name"]]) for one in procedure["nuisances"]},
                {one["name"]: float(line[one["name"]]) for one in procedure["outputs"] if line[one["name"]]},
            )
            for line in csv.DictReader(file)
        )
    found: dict[tuple[str, int], dict[int, Draw]] = {}
    if procedure.get("variations"):
        with (folder / "variations.csv").open(encoding="utf-8", newline="") as file:
            for line in csv.DictReader(file):
                own = found.setdefault((line["variation"], int(line["setting"])), {})
                number = int(line["draw"])
                before = own[number].outputs if number in own else {}
                own[number] = Draw(number, int(line["seed"]), {}, {**before, line["output"]: float(line["value"])})
    variations = {key: tuple(own.values()) for key, own in found.items()}
    return Result(procedure, about["seed"], about["made_by"], about["cpu_s"], draws, variations)
