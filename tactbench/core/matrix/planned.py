"""What a run is about before anything is done: its cells, and the recordings they need."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

from tactbench.core.errors import UsageError
from tactbench.core.matrix.execution import rig_of
from tactbench.core.matrix.material import Need, Order, need_of, on_the_shelf, orders_for, sensors_on, serving
from tactbench.core.matrix.plan import Cell, plan_cells
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.interfaces import Shelf
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.matrix import MatrixSpec


@dataclass(frozen=True)
class Needed:
    """The recordings that the cells of a run need."""

    orders: dict[Need, list[Order]]
    """Those that a rig makes."""
    shelf: dict[Need, list[Path]]
    """Those that were made elsewhere."""
    recorded: Recorded

    def paths(self, cell: Cell) -> list[Path]:
        """Return where the recordings of a cell lie, or will lie."""
        wanted = need_of(cell)
        return self.shelf.get(wanted) or [order.path for order in self.orders.get(wanted, ())]


def planned(
    matrix: MatrixSpec,
    registry: Registry,
    sources: SourceDigests,
    store: Store,
    recordings: Path | None,
    recorded: Recorded,
) -> tuple[list[Cell], Needed]:
    """Return the cells of `matrix`, in order, and the recordings they need.

    Raises
    ------
    UsageError
        If the matrix asks for something that is not there.
    """
    # A simulated rig is no shelf: it is built when it has something to record.
    rig = None if registry.rigs[matrix.rig].simulated else rig_of(matrix.rig, registry, recordings)
    if hasattr(rig, "recordings"):
        found = on_the_shelf(cast(Shelf, rig), recorded)
        cells = plan_cells(matrix, sensors_on(found, matrix.sensors), registry)
        shelf = {
            wanted: serving(registry.tasks[wanted[1]].spec, wanted[2], found[wanted[0]])
            for wanted in dict.fromkeys(need_of(cell) for cell in cells)
        }
        return cells, Needed({}, shelf, recorded)
    if not matrix.sensors:
        raise UsageError("No sensor is named.", hint=f"Give --sensor; known: {', '.join(registry.sensors.names())}.")
    sensors = [registry.sensors[name].name for name in matrix.sensors]
    cells = plan_cells(matrix, sensors, registry)
    return cells, Needed(orders_for(cells, registry, sources, store, matrix.simulation), {}, recorded)
