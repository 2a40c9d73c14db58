"""A benchmark run: its options, the matrix that they describe, and its execution, also with other nuisances."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.leaderboard.sensitivity import FOLDER, ends_of, name_of, ranges_of, sensitivities
from tactbench.core.matrix.run import EngineChoice, EngineName, Outcome, run_matrix
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.pool import Limits
from tactbench.core.spec.matrix import (
    MOST_MEMORY_MB,
    MOST_REPEATS,
    MOST_SECONDS,
    EstimatorChoice,
    MatrixSpec,
    TaskChoice,
)
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.yaml_file import load_yaml
from tactbench.core.study.files import matrix_called
from tactbench.core.study.options import simulation_of
from tactbench.core.study.terminal import TerminalOperator, progress
from tactbench.core.tables.terminal import remark


def _each(given: Any) -> Any:
    """Return a word or path, or a sequence of them, as a list of words; an empty list for None."""
    several = () if given is None else (given,) if isinstance(given, str | os.PathLike) else given
    if not isinstance(several, Iterable):
        return given
    return [os.fspath(one) if isinstance(one, os.PathLike) else one for one in several]


Words = Annotated[
    tuple[str, ...], BeforeValidator(_each), AfterValidator(lambda words: tuple(dict.fromkeys(words)))
]  # fmt: skip


class Study(Frozen):
    """The options of ``tactbench run``; options that are not given take the values of the matrix file."""

    sensor: Words = ()
    task: Words = ()
    rig: str | None = None
    recordings: Path | None = None
    dataset: Words = ()
    rig_file: Path | None = None
    protocol: Words = ()
    split: Words = ()
    estimator: Words | None = None
    """Names of estimators; trivial estimators are always run as well, and alone if this is empty."""
    config: Path | None = None
    repeats: int | None = Field(default=None, ge=1, le=MOST_REPEATS)
    seed: int | None = Field(default=None, ge=0)
    probe: bool = False
    include_incomplete: bool = False
    effects: str | None = None
    set: Words = ()
    engine: EngineName = "isolated"
    jobs: int | None = Field(default=None, ge=1)
    timeout: float | None = Field(default=None, gt=0, le=MOST_SECONDS)
    memory: int | None = Field(default=None, ge=1, le=MOST_MEMORY_MB)
    root: Path | None = None
    out: Path = Path("tactbench-results")
    yes: bool = False


def carry_out(study: Study) -> tuple[Store, Outcome]:
    """Run a study, showing its progress; return the result folder and the outcome of its cells.

    Raises as `matrix_of` and `tactbench.core.matrix.run.run_matrix` do.
    """
    matrix = matrix_of(study, installed())
    store = Store(study.out)
    with progress() as display:
        outcome = run_matrix(
            matrix, store,
            choice=EngineChoice(study.engine, study.jobs, Limits(matrix.timeout_s, matrix.memory_mb)),
            recordings=Path(matrix.recordings) if matrix.recordings else None, root=study.root, progress=display,
            operator=TerminalOperator(yes=study.yes, paused=display.paused) if matrix.rig_file else None,
        )  # fmt: skip
    return store, outcome


def matrix_of(study: Study, registry: Registry) -> MatrixSpec:
    """Return the matrix of the file, with its values replaced by the options of the study.

    Raises
    ------
    UsageError
        If a file, a name or a combination of options is invalid.
    """
    matrix = matrix_called(study.config or ("real" if study.dataset else None))
    simulated, replays = registry.first_rig("simulated"), registry.first_rig("replays")
    change: dict[str, Any] = {"rig": matrix.rig or simulated}
    over: dict[str, Any] = {}
    if study.dataset and (study.recordings or study.rig_file or study.rig not in (None, replays)):
        raise UsageError("--dataset replaces all recordings.", hint="Leave out --rig, --recordings and --rig-file.")
    if study.rig or study.recordings or study.rig_file or study.dataset:
        file = load_yaml(study.rig_file, RigFile) if study.rig_file else None
        change["rig"] = study.rig or (file.rig if file else replays)
        change["rig_file"] = study.rig_file and str(study.rig_file)
        if change["rig"] != matrix.rig:
            change["sensors"] = tuple(file.sensors) if file else ()  # the matrix' sensors are those of its own rig
            over["protocol"] = ("deployable",)  # the paper's protocol needs the paper's three roles
    stated = {"sensors": study.sensor, "timeout_s": study.timeout, "memory_mb": study.memory}
    change |= {name: value for name, value in stated.items() if value}
    change |= study.model_dump(include={"repeats", "seed", "probe", "include_incomplete"}, exclude_defaults=True)
    over |= study.model_dump(include={"protocol", "split"}, exclude_defaults=True)
    if study.estimator is not None:
        over["estimators"] = tuple(EstimatorChoice(name=name) for name in study.estimator)
    if study.recordings:
        change["recordings"], over["dataset"] = str(study.recordings), None
    if study.dataset:
        tasks = _of_datasets(study, matrix)
    else:
        known = {name: [choice for choice in matrix.tasks if choice.name == name] for name in study.task}
        tasks = [one for name, choices in known.items() for one in choices or [TaskChoice(name=name)]]
    chosen = [choice.model_copy(update=over) for choice in tasks or matrix.tasks]
    change["tasks"] = tuple(_with_those_beside(chosen, registry))
    matrix = matrix.model_copy(update=change)
    change = {"simulation": simulation_of(registry, matrix.rig, matrix.sensors, study.effects, study.set,
                                          matrix.simulation)}  # fmt: skip
    return matrix.model_copy(update=change)


def _of_datasets(study: Study, matrix: MatrixSpec) -> list[TaskChoice]:
    """Return the tasks for each data set: those of the study, or else all of the data set, with the matrix' options."""
    from tactbench.core.recording.datasets import dataset_called

    found = []
    for given, dataset in {given: dataset_called(given) for given in study.dataset}.items():
        for name in study.task or dict.fromkeys(dataset.source.tasks):
            plain = TaskChoice(name=name, protocol=("deployable",))
            stated = [one for one in matrix.tasks if one.name == name and one.dataset in (None, given, dataset.name)]
            found += [one.model_copy(update={"dataset": given}) for one in stated or [plain]]
    return found


def _with_those_beside(choices: list[TaskChoice], registry: Registry) -> Iterator[TaskChoice]:
    """Yield the tasks, each followed by those in its field `beside`, with the same protocol, split and estimators."""
    names = {choice.name for choice in choices}
    for choice in choices:
        yield choice
        if choice.name in registry.tasks:  # an unknown name is refused with all others
            beside = registry.tasks[choice.name].spec.beside
            yield from (choice.model_copy(update={"name": name}) for name in beside if name not in names)


Single = tuple[str, str]
"""Name of a nuisance, and the end of its range: ``lower`` or ``upper``."""
STRONGEST = 3
"""Number of nuisances that are also set in pairs: those with the largest improvement of scores at an end."""


def carry_out_sensitivity(study: Study, nuisances: Sequence[str] = ()) -> list[Row]:
    """Run a task as its scenes state, and with `nuisances` (empty: all) at range ends; return rows of failed cells.

    Raises
    ------
    UsageError
        If the rig is not simulated, or a name is unknown.
    """
    registry = installed()
    matrix = matrix_of(study, registry)
    if not registry.rigs[matrix.rig].simulated:
        raise UsageError(f"Nuisances need a simulated rig, not {matrix.rig}.", hint="Use the rig twin.")
    singles = _singles(matrix, registry, nuisances)
    store, choice = Store(study.out), EngineChoice(jobs=study.jobs)
    untimed = matrix.model_copy(update={"latency": False})  # times would be measured with nothing else at work
    with progress() as display:
        stopped = run_matrix(matrix, store, choice=choice, progress=display).failures

        def run(ends: Mapping[str, str]) -> None:
            remark(f"{name_of(ends)}:")
            folder = Store(study.out / FOLDER / name_of(ends))
            for sensor in matrix.sensors:
                own = {one[0]: singles[one][sensor] for one in ends.items() if sensor in singles[one]}
                if not own:
                    continue
                nuisances = tuple(sorted({**dict(matrix.simulation.nuisances), **own}.items()))
                simulation = matrix.simulation.model_copy(update={"nuisances": nuisances})
                part = untimed.model_copy(update={"sensors": (sensor,), "simulation": simulation})
                stopped.extend(run_matrix(part, folder, choice=choice, progress=display).failures)

        for one in singles:
            run(dict([one]))
        for pair in combinations(_strongest(store, {choice.name for choice in matrix.tasks}, set(singles)), 2):
            run(dict(pair))
    return stopped


def _singles(
    matrix: MatrixSpec, registry: Registry, nuisances: Sequence[str]
) -> dict[tuple[str, str], dict[str, float]]:
    """Return values by sensor, for each (nuisance, end) that differs from the stated value, in the nuisance's unit.

    A nuisance that varies between the task's scenes is the subject of the task, and is left out.

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
    found: dict[Single, dict[str, float]] = {}
    for nuisance in nuisances or known:
        for sensor, spec in specs.items():
            own = {name: amount.value for name, amount in spec.settable().items()} | dict(matrix.simulation.nuisances)
            stated = {{**scene.nuisances(), **own}.get(nuisance) for scene in scenes}
            for end in ("lower", "upper") if nuisance in ranges[sensor] and len(stated) == 1 else ():
                value = getattr(ranges[sensor][nuisance], end)
                if value not in stated:
                    found.setdefault((nuisance, end), {})[sensor] = value
    return found


def _strongest(store: Store, tasks: set[str], singles: set[Single]) -> list[Single]:
    """Return the (nuisance, end) pairs with the largest improvement of scores among those computed."""
    best: dict[str, tuple[float, str]] = {}
    for one in sensitivities(store).values():
        for name in one.rows:
            ((nuisance, end), *more) = ends_of(name).items()
            if one.task in tasks and (nuisance, end) in singles and not more and one.gain(name) > 0:
                best[nuisance] = max(best.get(nuisance, (0.0, "")), (one.gain(name), end))
    return [(nuisance, best[nuisance][1]) for nuisance in sorted(best, key=lambda one: -best[one][0])[:STRONGEST]]
