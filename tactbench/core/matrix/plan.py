"""Planning of the cells of a matrix; all names are checked before any cell is run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.evaluation.protocols import (
    DEPLOYABLE,
    FIRST_FRAME,
    is_probe,
    protocol_called,
    shots,
    without_options,
)
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.matrix import REPLICATES, EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.spec.scene import Simulation
from tactbench.core.spec.task import TaskSpec

_AS_PLANNED = Simulation()
Way = tuple[str, str | None]
"""A protocol and a split; None: the task's first split that is possible with the recordings."""

ALIKE = (
    "sensor", "task", "rig", "protocol", "split", "estimator", "seed", "declared_task", "include_incomplete",
)  # fmt: skip
"""Names of the fields that result rows and cells have in common."""


@dataclass(frozen=True)
class Cell:
    """One combination of sensor, task, rig, protocol, split and estimator, for one replicate."""

    sensor: str
    task: str
    rig: str
    protocol: str
    split: str | None
    estimator: str
    params: tuple[tuple[str, Any], ...]
    baseline: bool
    seed: int
    """Random seed of this replicate's scenes and estimators, which identifies the replicate."""
    timed: bool = True
    """True if fit time and latency are measured, with no other cell running; by default for the first replicate."""
    simulation: Simulation = _AS_PLANNED
    """Settings of the simulation, if the rig is simulated."""
    include_incomplete: bool = False
    """True to include incomplete recordings in the evaluation."""
    declared_task: str = ""
    """Declaration of a task stated in the recordings, as JSON; empty for an installed task."""

    @cached_property
    def name(self) -> str:
        """Name of the cell, unique in a matrix: sensor/task/rig/protocol:split/estimator/seed."""
        options = "".join(f",{key}={value}" for key, value in self.params)
        split = f":{self.split}" if self.split else ""
        path = (self.sensor, self.task, self.rig, f"{self.protocol}{split}", f"{self.estimator}{options}")
        return "/".join((*path, str(self.seed)))


def cell_of(row: Mapping[str, Any]) -> Cell:
    """Return the cell of a result row."""
    cell = Cell(
        **{name: row[name] for name in ALIKE},
        params=tuple(sorted(row["params"].items())),
        baseline=row["is_baseline"],
        timed=row["status"] != "done" or row["latency_n"] is not None,
        simulation=Simulation.model_validate(row["simulation"]),
    )
    # A row has the split that was taken; its name contains the split only if the matrix named one.
    found = replace(cell, split=None)
    return found if found.name == row["cell"] else cell


def plan_cells(matrix: MatrixSpec, sensors: Sequence[str], registry: Registry) -> list[Cell]:
    """Return the cells of `matrix` on installed `sensors`, in the order in which they are run and stored.

    Raises
    ------
    UsageError
        If a name is unknown, a protocol or split is not one of the task's, an estimator does not support this kind of
        task, or a parameter is not one of the estimator's.
    """
    cells: dict[Cell, None] = {}
    rig = registry.rigs[matrix.rig or registry.first_rig("simulated")]
    tasks = {choice.name: registry.tasks.owned(choice.name) for choice in matrix.tasks}
    own = {
        name: matrix.repeats or ((owned.descriptor.spec.replicates or REPLICATES) if rig.simulated else 1)
        for name, owned in tasks.items()
    }
    for replicate, choice in product(range(max(own.values())), matrix.tasks):
        owned = tasks[choice.name]
        task = owned.descriptor.spec
        ways = _ways(task, choice)
        ways += _probes(task, ways) if matrix.probe else []
        for sensor, (protocol, split), chosen in product(sensors, ways, _estimators(task, choice, registry)):
            if replicate < own[choice.name]:
                cell = Cell(
                    sensor=sensor,
                    task=task.name,
                    rig=rig.name,
                    protocol=protocol,
                    split=split,
                    estimator=chosen.name,
                    params=tuple(sorted(chosen.params.items())),
                    baseline=registry.estimators[chosen.name].baseline,
                    seed=matrix.seed + replicate,
                    timed=matrix.latency and replicate == 0,
                    simulation=matrix.simulation,
                    include_incomplete=matrix.include_incomplete,
                    declared_task=owned.declared,
                )
                cells[cell] = None  # each once, in the order of the matrix
    if matrix.probe and all(cell.split == "in-session" for cell in cells):
        raise UsageError(
            "The split in-session cannot be probed: it divides each recording in time.",
            hint="Give another --split, or leave out --probe.",
        )
    return list(cells)


def _probes(task: TaskSpec, ways: Sequence[Way]) -> list[Way]:
    """Return the pairs (protocol, split) by which the answers of `ways` are tested for leakage.

    These are `deployable` with the same split, `first-frame`, and shuffled rows. A split in time separates no
    recordings and is not tested.
    """
    found = []
    for protocol, split in ways:
        rules = protocol_called(protocol)
        if rules.roles_only:
            split = None if task.splits[:1] == ("roles",) else "roles"
        honest = None if split == "shuffled" else split
        if not rules.first_row_only and split != "in-session":
            found += [(DEPLOYABLE.name, honest), (FIRST_FRAME.name, honest), (DEPLOYABLE.name, "shuffled")]
    return found


def _ways(task: TaskSpec, choice: TaskChoice) -> list[Way]:
    """Return all combinations (protocol, split) of the chosen protocols and splits.

    UsageError is raised if no combination is compatible; otherwise incompatible combinations become skipped rows.
    """
    for name in choice.protocol:
        if without_options(name) not in task.protocols and not is_probe(name):
            raise UnknownNameError(f"protocol of task {task.name!r}", name, task.protocols)
        protocol_called(name)
    splits: list[str | None] = list(dict.fromkeys(split for name in choice.split for split in _expanded(task, name)))
    ways = list(product(choice.protocol or task.protocols[:1], splits or [None]))
    if all(not serves(protocol, split) for protocol, split in ways):
        protocol, split = ways[0]
        raise UsageError(
            f"Protocol {protocol!r} allows only the split roles; {split!r} was given.",
            hint=f"Give another --protocol of the task: {', '.join(task.protocols)}.",
        )
    return ways


def serves(protocol: str, split: str | None) -> bool:
    """Return True if a protocol is compatible with a split."""
    return split in (None, "roles") or not protocol_called(protocol).roles_only


def _expanded(task: TaskSpec, split: str) -> tuple[str, ...]:
    """Return the splits with a name; ``few-shot`` is short for all splits ``few-shot-N`` of a task."""
    few = tuple(name for name in task.splits if shots(name))
    return few if split == "few-shot" and few else (split,)


def _estimators(task: TaskSpec, choice: TaskChoice, registry: Registry) -> list[EstimatorChoice]:
    own = [EstimatorChoice(name=name) for name in task.estimators]
    choices = own if choice.estimators is None else list(choice.estimators)
    whole = any(estimator.name == "all" for estimator in choices)
    fit = [other for other in registry.estimators if task.kind in other.kinds] if whole else []
    choices = [estimator for estimator in choices if estimator.name != "all"]
    choices += [EstimatorChoice(name=other.name) for other in fit if not other.baseline]
    # The task's own baselines come before any other.
    trivial = [*task.baselines, *(other.name for other in fit if other.baseline)]
    choices += [EstimatorChoice(name=name) for name in dict.fromkeys(trivial)]
    for estimator in choices:
        descriptor = registry.estimators[estimator.name]
        if task.kind not in descriptor.kinds:
            fitting = [other.name for other in registry.estimators if task.kind in other.kinds]
            raise UsageError(
                f"The estimator {estimator.name!r} is for {' and '.join(descriptor.kinds)}; task {task.name!r} is "
                f"{task.kind}.",
                hint=f"Estimators for this task: {', '.join(fitting)}.",
            )
        for parameter in estimator.params:
            if parameter not in descriptor.params:
                raise UnknownNameError(f"parameter of estimator {estimator.name!r}", parameter, descriptor.params)
    return choices
