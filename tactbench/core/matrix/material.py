"""The recordings a cell needs: found on a shelf, or still to be made by a rig."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from tactbench.core.errors import MissingRecordingError, UnknownNameError
from tactbench.core.matrix.keys import recording_key
from tactbench.core.matrix.plan import Cell, serves
from tactbench.core.matrix.recorded import Recorded, Subject
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.interfaces import Shelf
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.scene import Role, Scene, Simulation
from tactbench.core.spec.task import TaskSpec

Need = tuple[str, str, str | None, int]
"""Sensor, task, split and seed: what decides which recordings a cell needs."""


def need_of(cell: Cell) -> Need:
    """Return what recordings a cell needs; those of a split that its protocol cannot serve are never made."""
    return cell.sensor, cell.task, cell.split if serves(cell.protocol, cell.split) else None, cell.seed


@dataclass(frozen=True)
class Order:
    """One recording to be made."""

    sensor: str
    rig: str
    scene: Scene
    role: Role
    seed: int
    path: Path


def orders_for(
    cells: Iterable[Cell], registry: Registry, sources: SourceDigests, store: Store, simulation: Simulation
) -> dict[Need, list[Order]]:
    """Return the recordings needed, in the campaign's order, carried out as `simulation` asks.

    Tasks and campaigns that ask for the same scene in the same role share the recording.
    """
    orders: dict[Need, list[Order]] = {}
    for cell in cells:
        wanted = need_of(cell)
        if wanted in orders:
            continue
        orders[wanted] = []
        for planned in registry.tasks[cell.task].spec.scenes_for(wanted[2]):
            scene = planned.scene
            if simulation != Simulation():
                scene = scene.model_copy(update={"simulation": simulation})
            key = recording_key(cell.sensor, cell.rig, scene, planned.role, cell.seed, registry, sources)
            path = store.recording_path(cell.sensor, scene.name, key)
            orders[wanted].append(Order(cell.sensor, cell.rig, scene, planned.role, cell.seed, path))
    return orders


def on_the_shelf(shelf: Shelf, recorded: Recorded) -> dict[str, dict[Path, Subject]]:
    """Return what a shelf holds, by name of sensor; raises MissingRecordingError if it holds nothing."""
    found: dict[str, dict[Path, Subject]] = {}
    for path in shelf.recordings():
        subject = recorded.subject(path)
        found.setdefault(subject.sensor, {})[path] = subject
    if not found:
        raise MissingRecordingError("The shelf is empty.", hint="Import recordings with `tactbench import`.")
    return found


def sensors_on(shelf: Mapping[str, Mapping[Path, Subject]], asked: Iterable[str]) -> list[str]:
    """Return the sensors to run: those asked for, or all that the shelf has recordings of."""
    names = list(asked)
    for name in names:
        if name not in shelf:
            raise UnknownNameError("sensor in these recordings", name, shelf)
    return names or sorted(shelf)


def serving(task: TaskSpec, split: str | None, recordings: Mapping[Path, Subject]) -> list[Path]:
    """Return the recordings of a shelf that belong to `task` under `split`.

    A recording of a scene that some task planned serves the campaigns that plan a scene of this name; a recording whose
    scene nobody planned (an imported table) may serve any task.
    """
    names = {planned.scene.name for planned in task.scenes_for(split)}
    return [path for path, (_, scene) in recordings.items() if scene is None or not names or scene in names]
