"""A benchmark run: its options, the matrix that these options describe, and its execution."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

from tactbench.core.errors import UsageError
from tactbench.core.matrix.run import EngineChoice, EngineName, Outcome, run_matrix
from tactbench.core.matrix.store import Store
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
from tactbench.core.study.operator import TerminalOperator
from tactbench.core.study.progress import progress
from tactbench.core.study.shipped import matrix_called
from tactbench.core.study.simulation import simulation_of


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
