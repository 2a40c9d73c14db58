"""How far the twin's default readings are from those of converged grids, and how its load tables add to it.

Caps of 5, 10 and 40 mm and a flat surface, each beside the grid's own places, at nine loads to 5 N. The error is that
of the change from rest, relative, rms over loads, contacts and channels; the reference is the finest row (a skin of
144 x 192 cells with conduction on 288 x 279, and 176 x 192 cells for the iCub). The last rows replace the solves at
the nine loads by the load table that recordings use.

Usage: python benchmarks/twin_convergence.py
"""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np

from tactbench.plugin import FloatArray, SensorSpec, load_object
from tactbench.rigs.twin.contact.load_table import build_table
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tactbench.rigs.twin.synthesis import Fidelity
from tactbench.sensors.biotac import SPEC as BIOTAC
from tactbench.sensors.icub import SPEC as ICUB

LOADS_N = np.array([0.1, 0.25, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0, 5.0])
# Off the cells' centres and edges, by other amounts each.
OFFSETS = ((5.0, 0.07, 0.11), (10.0, -0.08, -0.07), (40.0, -0.03, 0.06), (math.inf, 0.1, 0.1))
WHITE_COUNT = 0.35
"""White noise of a channel of either sensor."""


@dataclasses.dataclass(frozen=True)
class Grids(Fidelity):
    """Accuracy settings, and cells per skin cell and axis in the BioTac's conduction."""

    conduction_refinement: int = 2

    def options(self, spec: SensorSpec) -> dict[str, int]:
        """Return the keywords of a sensor's transducer."""
        return {"refinement": self.conduction_refinement} if spec is BIOTAC else {}


DEFAULT = Grids()


def pressed(spec: SensorSpec, contact: Contact, fidelity: Fidelity):
    """Return the press and the transducer of one contact."""
    skin = spec.skin
    grid = skin_grid(skin.sheet, fidelity.cells(skin.sheet))
    medium = medium_of(skin, grid)
    core = (lambda below: with_core(below, skin)) if medium.has_core else None
    gap = gap_mm(grid, contact, skin.sheet)
    press = Press(medium, gap, contact, core=core, tolerance=fidelity.newton_tolerance)
    factory = load_object(f"tactbench.sensors.{spec.name}.transduction:build")
    names = [channel.name for channel in spec.channels("taxel")]
    return press, factory(spec, grid, names, **fidelity.options(spec))


def changes(spec: SensorSpec, fidelity: Fidelity, *, table: bool = False) -> FloatArray:
    """Return (contacts, loads, channels) changes from rest."""
    made = []
    for radius, off_x, s in OFFSETS:
        contact = Contact(radius, spec.parameters["contact_x"].to("mm") + off_x, s)
        press, read = pressed(spec, contact, fidelity)
        rest = read(press(0.0))
        if table:
            nuisances = spec.nuisances["taxel"]
            hidden = math.hypot(nuisances.white.value, nuisances.step.value / math.sqrt(12))
            tolerance = np.full(rest.size, hidden * fidelity.table_tolerance_factor)
            tabulated = build_table(press, read, largest_n=5.0, tolerance=tolerance, most_nodes=fidelity.most_nodes)
            made.append(tabulated(LOADS_N) - rest)
        else:
            made.append(np.stack([read(press(float(load))) - rest for load in LOADS_N]))
    return np.stack(made)


def rows(spec: SensorSpec) -> list[tuple[str, Fidelity]]:
    """Return the grids of a sensor, coarse to fine, the default among them, the reference last."""
    if spec is ICUB:
        factors = (0.5, 0.75, 1.0, 1.5, 2.0, 4.0)
        return [(f"skin x {factor:g}", dataclasses.replace(DEFAULT, cells_factor=factor)) for factor in factors]
    points = ((1.0, 1), (1.0, 2), (1.0, 3), (2.0, 2), (2.0, 3), (3.0, 2))
    return [
        (
            f"skin x {factor:g}, conduction x {refinement}",
            dataclasses.replace(DEFAULT, cells_factor=factor, conduction_refinement=refinement),
        )
        for factor, refinement in points
    ]


def main() -> None:
    """Print the tables."""
    for spec in (BIOTAC, ICUB):
        found, seconds = [], []
        for _, fidelity in rows(spec):
            began = time.process_time()
            found.append(changes(spec, fidelity))
            seconds.append(time.process_time() - began)
        reference = found[-1]
        scale = np.sqrt(np.mean(reference**2))
        print(f"{spec.name}: rms change {scale:.1f} counts, white noise {WHITE_COUNT} counts")
        print(
            f"  {'grid':<28}{'cells':>10}{'error %':>9}{'by contact %':>24}{'most, counts':>14}{'order':>7}{'CPU s':>7}"
        )
        before = None
        for (label, fidelity), change, cost in zip(rows(spec), found, seconds, strict=True):
            report(label, spec, fidelity, change, reference, cost, before)
            before = (fidelity, np.sqrt(np.mean((change - reference) ** 2)))
        began = time.process_time()
        whole = changes(spec, DEFAULT, table=True)
        report("default with load table", spec, DEFAULT, whole, reference, time.process_time() - began, None)


def report(
    label: str,
    spec: SensorSpec,
    fidelity: Fidelity,
    change: FloatArray,
    reference: FloatArray,
    cost: float,
    before: tuple[Fidelity, float] | None,
) -> None:
    """Print one row; the order is that against the row above, by the finest cell's width."""
    error = np.sqrt(np.mean((change - reference) ** 2))
    own = np.sqrt(np.mean((change - reference) ** 2, axis=(1, 2)) / np.mean(reference**2, axis=(1, 2)))
    order = ""
    if before is not None and error > 0:
        finer = (fidelity.cells_factor * fidelity.conduction_refinement) / (
            before[0].cells_factor * before[0].conduction_refinement
        )
        order = f"{math.log(before[1] / error) / math.log(finer):.1f}" if finer > 1 else ""
    along, across = fidelity.cells(spec.skin.sheet)
    total = error / np.sqrt(np.mean(reference**2))
    print(
        f"  {label:<28}{f'{along}x{across}':>10}{100 * total:>9.3f}"
        f"{' '.join(f'{100 * each:.2f}' for each in own):>24}{np.abs(change - reference).max():>14.2f}"
        f"{order:>7}{cost:>7.2f}"
    )


if __name__ == "__main__":
    main()
