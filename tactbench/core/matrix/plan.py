"""From a matrix to its cells: every name is checked before anything is run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME, PROTOCOLS, protocol_called
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.spec.task import TaskSpec


@dataclass(frozen=True)
class Cell:
    """One (sensor, task, rig, protocol, estimator, repeat)."""

    sensor: str
    task: str
    rig: str
    protocol: str
    split: str | None
    estimator: str
    params: tuple[tuple[str, Any], ...]
    baseline: bool
    repeat: int
    repeats: int
    seed: int
    """Seed of this repeat: of the scenes it records and of its estimators."""

    @property
    def name(self) -> str:
        """A readable name, unique in a matrix."""
        options = "".join(f",{key}={value}" for key, value in self.params)
        split = f":{self.split}" if self.split else ""
        path = (self.sensor, self.task, self.rig, f"{self.protocol}{split}", f"{self.estimator}{options}")
        return "/".join((*path, str(self.repeat)))


def plan_cells(matrix: MatrixSpec, sensors: Sequence[str], registry: Registry) -> list[Cell]:
    """List the cells of `matrix`, in the order in which they are run and stored.

    Parameters
    ----------
    matrix
        What to run.
    sensors
        The sensors to run it on, already checked.
    registry
        Where tasks and estimators are looked up.

    Raises
    ------
    UsageError
        If a name is unknown, a protocol or split is not one of the task's, an estimator cannot answer this kind of
        question, or a parameter is not one of the estimator's.
    """
    cells: list[Cell] = []
    for repeat in range(1, matrix.repeats + 1):
        for choice in matrix.tasks:
            task = registry.tasks[choice.name].spec
            protocol = _protocol(task, choice)
            for sensor in sensors:
                for answer in _estimators(task, choice, registry):
                    cell = Cell(
                        sensor=sensor,
                        task=task.name,
                        rig=matrix.rig,
                        protocol=protocol,
                        split=choice.split,
                        estimator=answer.name,
                        params=tuple(sorted(answer.params.items())),
                        baseline=registry.estimators[answer.name].baseline,
                        repeat=repeat,
                        repeats=matrix.repeats,
                        seed=matrix.seed + repeat - 1,
                    )
                    if cell not in cells:
                        cells.append(cell)
    return with_probes(cells, registry) if matrix.probe else cells


def with_probes(cells: Sequence[Cell], registry: Registry) -> list[Cell]:
    """Return `cells` and, after them, those that show what their recordings give away.

    For every answer, and for its task's first baseline: the same under `deployable` with kept apart what the cell keeps
    apart, under `first-frame`, and with rows shuffled. A split in time keeps no recordings apart and is not probed.
    """
    every = list(cells)
    for cell in cells:
        rules = protocol_called(cell.protocol)
        trivial = registry.tasks[cell.task].spec.baselines[0]
        if rules.probe or cell.split == "in-session" or (cell.baseline and cell.estimator != trivial):
            continue
        split = "roles" if rules.roles_only else None if cell.split == "shuffled" else cell.split
        honest = replace(cell, protocol=DEPLOYABLE.name, split=split)
        added = (honest, replace(honest, protocol=FIRST_FRAME.name), replace(honest, split="shuffled"))
        every += [one for one in added if one not in every]
    return every


def _protocol(task: TaskSpec, choice: TaskChoice) -> str:
    if choice.protocol is None:
        protocol = task.protocols[0]
    elif choice.protocol in task.protocols or (choice.protocol in PROTOCOLS and PROTOCOLS[choice.protocol].probe):
        protocol = choice.protocol
    else:
        raise UnknownNameError(f"protocol of task {task.name!r}", choice.protocol, task.protocols)
    return protocol


def _estimators(task: TaskSpec, choice: TaskChoice, registry: Registry) -> list[EstimatorChoice]:
    asked = list(choice.estimators) or [EstimatorChoice(name=name) for name in task.estimators]
    asked += [EstimatorChoice(name=name) for name in task.baselines]
    for answer in asked:
        descriptor = registry.estimators[answer.name]
        if task.kind not in descriptor.kinds:
            fitting = [other.name for other in registry.estimators if task.kind in other.kinds]
            raise UsageError(
                f"The estimator {answer.name!r} does {' and '.join(descriptor.kinds)}; task {task.name!r} is "
                f"{task.kind}.",
                hint=f"Estimators for it: {', '.join(fitting)}.",
            )
        _known_parameters(answer.name, answer.params, descriptor.params)
    return asked


def _known_parameters(estimator: str, given: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    for parameter in given:
        if parameter not in known:
            raise UnknownNameError(f"parameter of estimator {estimator!r}", parameter, known)
