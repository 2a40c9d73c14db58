"""From a grid to one of half as many cells a side, and back."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.boundary_elements.active_set import Mask

_COARSEST = 32
"""A grid has a coarser one if that has at least this many cells a side: below, transforms cost no less."""


def can_halve(cells: tuple[int, int]) -> bool:
    """Whether there is a coarser grid."""
    return all(n % 2 == 0 and n // 2 >= _COARSEST for n in cells)


def cell_means(gap_mm: FloatArray, reachable: Mask) -> FloatArray:
    """Return the mean gap of each cell from the gap at its centre.

    ``g + (D²x g + D²s g) / 24`` with second differences: exact for a paraboloid. Of the second difference of a cell
    and those of its two neighbours the smallest counts, and none if they differ in sign: no bend is seen in a step
    or at an edge.
    """
    mean = gap_mm.copy()
    _add_bend(mean, gap_mm, reachable)
    _add_bend(mean.T, gap_mm.T, reachable.T)
    return mean


def _add_bend(mean: FloatArray, gap: FloatArray, reachable: Mask) -> None:
    """Add the bend along the first axis."""
    second = gap[2:] - 2 * gap[1:-1] + gap[:-2]
    second *= reachable[2:] & reachable[1:-1] & reachable[:-2]
    padded = np.concatenate([second[:1], second[:1], second, second[-1:], second[-1:]])
    low = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    high = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    mean += (np.maximum(low, 0.0) + np.minimum(high, 0.0)) / 24


def halve(gap_mm: FloatArray, reachable: Mask) -> tuple[FloatArray, Mask]:
    """Return the mean gap on half as many cells a side, and where it can be reached: if one of four can be."""
    weight = _four(reachable.astype(np.float64))
    known = weight > 0
    return _four(np.where(reachable, gap_mm, 0.0)) / np.where(known, weight, 1.0), known


def double(pressure: FloatArray) -> FloatArray:
    """Return a pressure >= 0 on twice as many cells a side.

    Its square is interpolated: under a smooth indenter that is what falls to zero in a straight line at the rim, and
    it is continued below zero by one cell, so that the rim falls between the fine cells as it should.
    """
    square = _continued(np.pad(pressure**2, 3, mode="edge"))
    along = np.empty((2 * pressure.shape[0], square.shape[1]))
    along[0::2] = 0.75 * square[1:-1] + 0.25 * square[:-2]
    along[1::2] = 0.75 * square[1:-1] + 0.25 * square[2:]
    both = np.empty((along.shape[0], 2 * pressure.shape[1]))
    both[:, 0::2] = 0.75 * along[:, 1:-1] + 0.25 * along[:, :-2]
    both[:, 1::2] = 0.75 * along[:, 1:-1] + 0.25 * along[:, 2:]
    fine: FloatArray = np.sqrt(np.maximum(both, 0.0, out=both), out=both)
    return fine


def _continued(square: FloatArray) -> FloatArray:
    """Return the field without its two outermost cells; beside the positive ones, zeros go on straight down."""
    middle, best = square[2:-2, 2:-2], np.full((square.shape[0] - 4, square.shape[1] - 4), -np.inf)
    near, far, across = (slice(1, -3), slice(3, -1)), (slice(0, -4), slice(4, None)), slice(2, -2)
    for one, two in zip(near, far, strict=True):
        for beside, beyond in ((square[one, across], square[two, across]), (square[across, one], square[across, two])):
            best = np.maximum(best, np.where(beside > 0, 2 * beside - beyond, -np.inf))
    return np.where(middle > 0, middle, np.where(np.isfinite(best), np.minimum(best, 0.0), 0.0))


def _four(field: FloatArray) -> FloatArray:
    """Return the (nx/2, ns/2) sums over four cells."""
    summed: FloatArray = field[0::2, 0::2] + field[1::2, 0::2] + field[0::2, 1::2] + field[1::2, 1::2]
    return summed
