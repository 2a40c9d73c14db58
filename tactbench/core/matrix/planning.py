"""What a run will do: its cells, and where their recordings come from. Nothing is recorded yet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar, cast

from tactbench.core.errors import NotApplicable, TactbenchError, UnknownNameError, UsageError
from tactbench.core.evaluation.few_shot import shots
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.installed import built, listed
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.material import Need, Order, need_of, orders_for
from tactbench.core.matrix.plan import FEW_SHOT, Cell, plan_cells
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.shelf import holdings, sensors_on, serving
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.interfaces import Shelf
from tactbench.core.plugins.registry import Registry
from tactbench.core.plugins.rig_files import load_rig_file
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.task import TaskSpec

R = TypeVar("R")
ACQUIRED_SPLITS = ("roles", "session", "recording", "unit", "in-session", "shuffled")
"""Splits that every recording acquired by a rig can be asked for; its scene's labels are further ones."""


@dataclass
class Material:
    """Where the recordings of cells come from."""

    recorded: Recorded
    """What is known of recordings, those made now among them."""
    orders: dict[Need, list[Order]] = field(default_factory=dict)
    """What a rig has to record."""
    shelf: dict[Need, list[Path]] = field(default_factory=dict)
    """What exists already."""
    troubles: dict[Need, BaseException] = field(default_factory=dict)
    """Why there are no recordings, or not all of them."""
    refused: dict[Path, BaseException] = field(default_factory=dict)
    """Recordings that could not be made, and why."""

    def paths(self, cell: Cell) -> list[Path]:
        """Return the recordings of a cell."""
        wanted = need_of(cell)
        return self.shelf.get(wanted) or [order.path for order in self.orders.get(wanted, ())]

    def trouble(self, cell: Cell) -> BaseException | None:
        """Return why a cell cannot have its recordings, if so."""
        wanted = need_of(cell)
        if wanted in self.troubles:
            return self.troubles[wanted]
        paths = self.paths(cell)
        if not paths:
            return NotApplicable(
                f"Task {cell.task!r} has no scenes for rig {cell.rig!r}, and there are no recordings of it.",
                hint="Use --rig replay --recordings DIR.",
            )
        return next((self.refused[path] for path in paths if path in self.refused), None)


def plan(
    matrix: MatrixSpec,
    registry: Registry,
    keys: Keys,
    store: Store,
    recordings: Path | None,
    recorded: Recorded,
    choice: EngineChoice | None = None,
) -> tuple[list[Cell], Material]:
    """Return the cells of `matrix`, and where their recordings come from.

    A rig that cannot be built, or that lists its recordings badly, costs the cells that need it, not the run.

    Raises
    ------
    UsageError
        If the matrix asks for something that is not there.
    """
    chosen = choice or EngineChoice()
    rig_file = load_rig_file(Path(matrix.rig_file), registry).checked_for(matrix.rig) if matrix.rig_file else None
    if not registry.rigs[matrix.rig].simulated:  # a simulated one is no shelf: it is built when it has to record
        rig = _greeted(lambda: built(matrix.rig, registry, recordings, rig_file), chosen)
        if isinstance(rig, BaseException):
            return _in_vain(matrix, registry, recorded, rig)
        if hasattr(rig, "recordings"):
            return _from_shelf(matrix, registry, cast(Shelf, rig), recorded, chosen)
    cells = plan_cells(matrix, _named(matrix, registry), registry, rig_file)
    for task in {cell.task for cell in cells}:
        _known_splits(registry.tasks[task].spec, [cell.split for cell in cells if cell.task == task])
    return cells, Material(recorded, orders_for(cells, registry, keys, store, matrix.simulation))


def _from_shelf(
    matrix: MatrixSpec, registry: Registry, shelf: Shelf, recorded: Recorded, choice: EngineChoice
) -> tuple[list[Cell], Material]:
    paths = _greeted(lambda: listed(matrix.rig, shelf), choice)
    if isinstance(paths, BaseException):
        return _in_vain(matrix, registry, recorded, paths)
    found = holdings(paths, matrix.sensors, registry, recorded, choice)
    cells = plan_cells(matrix, sensors_on(found, matrix.sensors), registry)
    material = Material(recorded)
    for wanted in dict.fromkeys(need_of(cell) for cell in cells):
        sensor, task, split, _ = wanted
        material.shelf[wanted], trouble = serving(registry.tasks[task].spec, split, sensor, found, registry)
        if trouble is not None:
            material.troubles[wanted] = trouble
    return cells, material


def _in_vain(
    matrix: MatrixSpec, registry: Registry, recorded: Recorded, trouble: BaseException
) -> tuple[list[Cell], Material]:
    """Return the cells of a rig that cannot be used; every one of them says why."""
    if not matrix.sensors:
        raise trouble
    cells = plan_cells(matrix, matrix.sensors, registry)
    return cells, Material(recorded, troubles={need_of(cell): trouble for cell in cells})


def _greeted(ask: Callable[[], R], choice: EngineChoice) -> R | BaseException:
    """Return what a rig says, or why it does not; raises what is the user's to mend."""
    from tactbench.core.pool.in_process import InProcess

    ((_, outcome),) = InProcess(choice.limits).each(lambda _: ask(), [None])
    if isinstance(outcome, TactbenchError) and outcome.exit_code == UsageError.exit_code:
        raise outcome
    return outcome


def _named(matrix: MatrixSpec, registry: Registry) -> list[str]:
    if not matrix.sensors:
        raise UsageError("No sensor is named.", hint=f"Give --sensor; known: {', '.join(registry.sensors.names())}.")
    return [registry.sensors[name].name for name in matrix.sensors]


def _known_splits(task: TaskSpec, splits: Sequence[str | None]) -> None:
    """Refuse a split that no recording of this task's scenes can be asked for, before any is made."""
    labels = {label for planned in task.scenes for label in planned.scene.labels}
    few = (FEW_SHOT,) if any(shots(name) for name in task.splits) else ()
    known = {*ACQUIRED_SPLITS, *task.splits, *task.campaigns, *labels, *few}
    for split in splits:
        if split is not None and split not in known and shots(split) is None:
            raise UnknownNameError(f"split of task {task.name!r}", split, known)
