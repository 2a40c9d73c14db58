"""A task carried out with nuisances at the ends of their ranges: ordinary runs, each into a folder of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.leaderboard.names import grouped
from tactbench.core.leaderboard.sensitivity import (
    FOLDER,
    Sensitivity,
    ends_of,
    name_of,
    ranges_of,
    read_variants,
    sensitivities,
)
from tactbench.core.matrix.run import EngineChoice, run_matrix
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec
from tactbench.core.study.progress import progress
from tactbench.core.study.study import Study, matrix_of
from tactbench.core.tables.terminal import remark

STRONGEST = 3
"""Nuisances that are set in pairs: those without which the sensors score best."""
Values = Mapping[str, Mapping[str, float]]
"""By sensor, what its nuisances are set to."""


def carry_out_sensitivity(study: Study, nuisances: Sequence[str] = ()) -> tuple[list[Sensitivity], list[Row]]:
    """Run a task as stated, and with `nuisances` (none: all) at ends; return what came out, and the cells that failed.

    Raises
    ------
    UsageError
        If the rig is not simulated, or a name is wrong.
    """
    registry = installed()
    matrix = _with_one_answer(matrix_of(study, registry), study, registry)
    if not registry.rigs[matrix.rig].simulated:
        raise UsageError(f"Nuisances are set on simulated rigs; {matrix.rig} is not one.", hint="Leave them out.")
    singles = _singles(matrix, registry, nuisances)
    store, choice = Store(study.out), EngineChoice(jobs=study.jobs)
    stopped: list[Row] = []
    with progress() as display:

        def run(values: Values, ends: Mapping[str, str] | None = None) -> None:
            folder = store if ends is None else Store(study.out / FOLDER / name_of(ends))
            for own, sensors in grouped(values, lambda sensor: tuple(sorted(values[sensor].items()))).items():
                simulation = {**dict(matrix.simulation.nuisances), **dict(own)}
                change = {
                    "sensors": tuple(sensors), "latency": matrix.latency and ends is None,
                    "simulation": matrix.simulation.model_copy(update={"nuisances": tuple(sorted(simulation.items()))}),
                }  # fmt: skip
                stopped.extend(
                    run_matrix(matrix.model_copy(update=change), folder, choice=choice, progress=display).failures
                )

        run({sensor: {} for sensor in matrix.sensors})
        for place, (name, values) in enumerate(singles.items(), start=1):
            remark(f"{place} of {len(singles)}: {name}")
            run(values, ends_of(name))
        for ends in _pairs(found_in(store, matrix), list(singles)):
            remark(f"pair: {name_of(ends)}")
            both = [singles[name_of({nuisance: end})] for nuisance, end in ends.items()]
            run({s: {**both[0].get(s, {}), **both[1].get(s, {})} for s in matrix.sensors if any(s in b for b in both)},
                ends)  # fmt: skip
    return found_in(store, matrix), stopped


def found_in(store: Store, matrix: MatrixSpec) -> list[Sensitivity]:
    """Return what has been computed of the task and the sensors of a matrix."""
    tasks = {choice.name for choice in matrix.tasks}

    def wanted(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
        return [row for row in rows if row["sensor"] in matrix.sensors and row["task"] in tasks]

    variants = {name: wanted(rows) for name, rows in read_variants(store.folder).items()}
    return list(sensitivities(wanted(store.rows()), variants).values())


def _with_one_answer(matrix: MatrixSpec, study: Study, registry: Registry) -> MatrixSpec:
    """Return the matrix with the first estimator of each task alone, where none is asked for."""
    if study.estimator is not None:
        return matrix
    tasks = []
    for choice in matrix.tasks:
        own = choice.estimators or (EstimatorChoice(name=registry.tasks[choice.name].spec.estimators[0]),)
        tasks.append(choice.model_copy(update={"estimators": own[:1]}))
    return matrix.model_copy(update={"tasks": tuple(tasks)})


def _singles(matrix: MatrixSpec, registry: Registry, nuisances: Sequence[str]) -> dict[str, Values]:
    """Return what each sensor's nuisances are set to at each end that differs from what is stated, by name of the end.

    Raises
    ------
    UnknownNameError
        If no sensor states a range of one of `nuisances`.
    """
    scenes = [planned.scene for choice in matrix.tasks for planned in registry.tasks[choice.name].spec.scenes]
    specs = {name: registry.sensors[name].spec.handled(matrix.simulation.scenario) for name in matrix.sensors}
    ranges = {name: ranges_of(spec) for name, spec in specs.items()}
    known = list(dict.fromkeys(nuisance for own in ranges.values() for nuisance in own))
    for nuisance in nuisances:
        if nuisance not in known:
            raise UnknownNameError("nuisance with a range", nuisance, known)
    found: dict[str, dict[str, dict[str, float]]] = {}
    for nuisance in nuisances or known:
        for sensor, spec in specs.items():
            given = {
                **{name: amount.value for name, amount in spec.settable().items()},
                **dict(matrix.simulation.nuisances),
            }
            stated = [{**scene.nuisances(), **given}.get(nuisance) for scene in scenes]
            for end in ("lower", "upper") if nuisance in ranges[sensor] else ():
                value = getattr(ranges[sensor][nuisance], end)
                if any(one != value for one in stated):
                    found.setdefault(name_of({nuisance: end}), {})[sensor] = {nuisance: value}
    return dict(found)


def _pairs(found: Sequence[Sensitivity], singles: Sequence[str]) -> list[dict[str, str]]:
    """Return the pairs of the nuisances without which the sensors score best, each at its better end."""
    best: dict[str, tuple[float, str]] = {}
    for one in found:
        for name in set(singles) & set(one.rows):
            ((nuisance, end),) = ends_of(name).items()
            best[nuisance] = max(best.get(nuisance, (0.0, "")), (one.gain(name), end))
    gains = sorted(((gain, nuisance, end) for nuisance, (gain, end) in best.items() if gain > 0), reverse=True)
    return [{one[1]: one[2], other[1]: other[2]} for one, other in combinations(gains[:STRONGEST], 2)]
