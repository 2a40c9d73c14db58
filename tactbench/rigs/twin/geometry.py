"""The unrolled skin, and the gap between it and an indenter. Lengths in mm, angles in rad."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, SkinGrid, SkinSheet

FAR_MM = 50.0
"""Gap where the cap does not exist any more (beyond its own radius)."""


@dataclass(frozen=True)
class Touch:
    """An indenter at a place: a cap of `radius_mm` (infinite: flat) with its apex at (x, s), slightly tilted."""

    radius_mm: float
    x_mm: float
    s_mm: float
    tilt_x: float = 0.0
    tilt_s: float = 0.0


def grid_of(sheet: SkinSheet, cells: tuple[int, int] | None = None) -> SkinGrid:
    """Return the cell centres of `sheet`.

    Parameters
    ----------
    sheet
        The unrolled skin.
    cells
        Axial x arc; None takes the sheet's own.
    """
    nx, ns = cells or sheet.cells
    x_min, x_max, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    dx, ds = (x_max - x_min) / nx, arc / ns
    x = x_min + (np.arange(nx, dtype=np.float64) + 0.5) * dx
    s = -arc / 2 + (np.arange(ns, dtype=np.float64) + 0.5) * ds
    return SkinGrid(x_mm=np.asarray(x, dtype=np.float64), s_mm=np.asarray(s, dtype=np.float64))


def gap_mm(grid: SkinGrid, touch: Touch, outer_radius_mm: float) -> FloatArray:
    """Return the gap at zero approach, (nx, ns), measured along the press axis, its minimum zero.

    The finger falls away from the tangent plane by ``2 Ro sin²(theta/2)`` and the cap by ``r² / (R + sqrt(R² - r²))``:
    the textbook forms ``Ro (1 - cos theta)`` and ``R - sqrt(R² - r²)`` lose all digits for small angles and large R.

    Parameters
    ----------
    grid, touch
        Skin and indenter.
    outer_radius_mm
        Radius of the finger; infinite for a flat pad.
    """
    along = grid.x_mm[:, None] - touch.x_mm
    arc = grid.s_mm[None, :] - touch.s_mm
    if math.isinf(outer_radius_mm):
        across, fall = arc, np.zeros_like(arc)
    else:
        angle = arc / outer_radius_mm
        across = outer_radius_mm * np.sin(angle)
        fall = 2.0 * outer_radius_mm * np.sin(angle / 2.0) ** 2
    gap = fall + _cap(along**2 + across**2, touch.radius_mm) + touch.tilt_x * along + touch.tilt_s * across
    # With a tilt the first point of touch is not the apex: without this the origin of the approach would move.
    return np.asarray(gap - gap.min())


def _cap(r2: FloatArray, radius: float) -> FloatArray:
    if math.isinf(radius):
        return np.zeros_like(r2)
    inside = r2 < (0.999 * radius) ** 2
    root = np.sqrt(np.where(inside, radius**2 - r2, 0.0))
    return np.where(inside, r2 / (radius + root), radius + FAR_MM)


def wave_numbers(grid: SkinGrid) -> tuple[FloatArray, FloatArray]:
    """Return the wave numbers (rad/mm) of a real two-dimensional transform on `grid`: (nx, 1) and (1, ns/2+1)."""
    dx, ds = grid.cell_mm
    kx = np.asarray(2.0 * np.pi * np.fft.fftfreq(len(grid.x_mm), dx), dtype=np.float64)
    ks = np.asarray(2.0 * np.pi * np.fft.rfftfreq(len(grid.s_mm), ds), dtype=np.float64)
    return kx[:, None], ks[None, :]
