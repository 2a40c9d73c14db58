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


def halve(gap_mm: FloatArray, reachable: Mask) -> tuple[FloatArray, Mask]:
    """Return the gap on half as many cells a side, at the coarse centres, and where it can be reached.

    The mean over four cells exceeds the value in their middle by ``h²/32`` times the Laplacian (h: coarse cell),
    which is taken off where all neighbours exist: exact for a paraboloid. A coarse cell can be reached if one of its
    four can.
    """
    weight = _four(reachable.astype(np.float64))
    known = weight > 0
    mean = _four(np.where(reachable, gap_mm, 0.0)) / np.where(known, weight, 1.0)
    full = weight == 4
    bend, clear = np.zeros_like(mean), full[1:-1, 1:-1].copy()
    for low, high in (((slice(0, -2), slice(1, -1)), (slice(2, None), slice(1, -1))),
                      ((slice(1, -1), slice(0, -2)), (slice(1, -1), slice(2, None)))):  # fmt: skip
        bend[1:-1, 1:-1] += mean[low] + mean[high] - 2 * mean[1:-1, 1:-1]
        clear &= full[low] & full[high]
    bend[1:-1, 1:-1] *= clear
    return mean - bend / 32, known


def double(pressure: FloatArray) -> FloatArray:
    """Return a pressure >= 0 on twice as many cells a side.

    Its square is interpolated: under a smooth indenter that is what falls to zero in a straight line at the rim, and
    it is continued below zero by one cell, so that the rim falls between the fine cells as it should.
    """
    square = _continued(np.pad(pressure**2, 2, mode="edge"))
    along = np.empty((2 * pressure.shape[0], square.shape[1]))
    along[0::2] = 0.75 * square[1:-1] + 0.25 * square[:-2]
    along[1::2] = 0.75 * square[1:-1] + 0.25 * square[2:]
    both = np.empty((along.shape[0], 2 * pressure.shape[1]))
    both[:, 0::2] = 0.75 * along[:, 1:-1] + 0.25 * along[:, :-2]
    both[:, 1::2] = 0.75 * along[:, 1:-1] + 0.25 * along[:, 2:]
    fine: FloatArray = np.sqrt(np.maximum(both, 0.0, out=both), out=both)
    return fine


def _continued(square: FloatArray) -> FloatArray:
    """Return the field without its outermost cells; beside the positive ones, zeros go on in a straight line down."""
    middle = square[1:-1, 1:-1]
    best = np.full(middle.shape, -np.inf)
    for axis in (0, 1):
        for side in (1, -1):
            near = np.roll(square, side, axis)[1:-1, 1:-1]
            far = np.roll(square, 2 * side, axis)[1:-1, 1:-1]
            best = np.maximum(best, np.where(near > 0, 2 * near - far, -np.inf))
    return np.where(middle > 0, middle, np.where(np.isfinite(best), np.minimum(best, 0.0), 0.0))


def _four(field: FloatArray) -> FloatArray:
    """Return the (nx/2, ns/2) sums over four cells."""
    summed: FloatArray = field[0::2, 0::2] + field[1::2, 0::2] + field[0::2, 1::2] + field[1::2, 1::2]
    return summed
