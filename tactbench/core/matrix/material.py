"""The recordings that cells need of a rig."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import Cell, serves
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.scene import Role, Scene, Simulation
from tactbench.core.spec.task import in_drawn_order

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
    rig_file: str = ""
    """What the rig file says, as canonical JSON; empty: there is none."""


def orders_for(
    cells: Iterable[Cell], registry: Registry, keys: Keys, store: Store, simulation: Simulation
) -> dict[Need, list[Order]]:
    """Return the recordings needed, in the campaign's order, carried out as `simulation` asks.

    Where the campaign leaves the order to be drawn, it is drawn with the cell's seed.
    Tasks and campaigns that ask for the same scene in the same role share the recording.
    """
    orders: dict[Need, list[Order]] = {}
    for cell in cells:
        wanted = need_of(cell)
        if wanted in orders:
            continue
        orders[wanted] = []
        for planned in in_drawn_order(registry.tasks[cell.task].spec.scenes_for(wanted[2]), cell.seed):
            scene = planned.scene
            if simulation != Simulation():
                scene = scene.model_copy(update={"simulation": simulation})
            key = keys.of_recording(cell.sensor, cell.rig, scene, planned.role, cell.seed, cell.rig_file)
            path = store.recording_path(cell.sensor, scene.name, key)
            orders[wanted].append(Order(cell.sensor, cell.rig, scene, planned.role, cell.seed, path, cell.rig_file))
    return orders
