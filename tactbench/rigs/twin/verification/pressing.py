"""What several checks press, and how they state a bound."""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import Verdict
from tactbench.rigs.twin.boundary_elements.contact import ElasticContact, press
from tactbench.rigs.twin.boundary_elements.kernels import Kernel

RADIUS_MM = 10.0


def centres_mm(cells: int, side_mm: float) -> FloatArray:
    """Return the (cells,) centres of a square domain around zero."""
    centres: FloatArray = (np.arange(cells, dtype=np.float64) + 0.5) * (side_mm / cells) - side_mm / 2
    return centres


def paraboloid_mm(
    cells: int, side_mm: float, x_mm: float = 0.0, s_mm: float = 0.0, radius_mm: float = RADIUS_MM
) -> FloatArray:
    """Return the (cells, cells) gap ``r²/2R`` under an apex."""
    x = centres_mm(cells, side_mm)
    gap: FloatArray = ((x[:, None] - x_mm) ** 2 + (x[None, :] - s_mm) ** 2) / (2 * radius_mm)
    return gap


def pressed(kernel: Kernel, gap_mm: FloatArray, side_mm: float, force_n: float) -> ElasticContact:
    """Return the surface under a gap on a square domain."""
    cell = side_mm / gap_mm.shape[0]
    return press(kernel, gap_mm, (cell, cell), force_n)


def within(name: str, found: float, bound: float, unit: str = "1", *, source: str, note: str = "") -> Verdict:
    """Return a verdict on a deviation of either sign."""
    return Verdict(name=name, found=found, low=-bound, high=bound, unit=unit, source=source, note=note)


def order(cells: list[int], errors: list[float]) -> float:
    """Return the order of convergence: minus the slope of log error over log cells."""
    return -float(np.polyfit(np.log(cells), np.log(errors), 1)[0])


def rms(values: list[float]) -> float:
    """Return the root mean square."""
    return math.sqrt(math.fsum(value**2 for value in values) / len(values))
