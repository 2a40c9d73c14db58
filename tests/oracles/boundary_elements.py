"""A rigid indenter on an elastic surface without friction, by boundary elements: the reference of contact.

Find ``p >= 0`` and ``delta`` with ``r = A p + g - delta >= 0``, ``p r = 0`` and ``sum p dA = F``, by the conjugate
gradients of Polonsky & Keer (1999, Wear 231). Pressure is constant on each cell and what counts is the mean
displacement of each cell (a Galerkin method), so that the depth under a paraboloid converges with about the third power
of the cell. Millimetres, newtons, MPa. It shares with the product the layer's compliance and nothing else; that is held
against finite elements.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactbench.rigs.twin.contact.media import compliance_shape

NEAR = 48
"""Cells up to which Love's closed form is used: beyond, its cancellation costs more than the series."""


@dataclass(frozen=True)
class HalfSpace:
    """An elastic half-space; pressure is zero outside the domain."""

    modulus_mpa: float
    """Plane strain modulus ``E* = E / (1 - nu²)``."""

    def compliance(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> tuple[np.ndarray, tuple[int, int]]:
        """Return the transform of the influence on a domain of twice the size (Liu, Wang & Liu 2000), and that size."""
        padded = (2 * cells[0], 2 * cells[1])
        away = [np.minimum(np.arange(n), n - np.arange(n)) for n in padded]
        return np.fft.rfft2(self._influence(cells, cell_mm)[np.ix_(*away)]).real, padded

    def _influence(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> np.ndarray:
        """Return the mean over one cell of ``1 / (pi E* r)`` integrated over the one (i, j) cells away.

        Second differences in both directions of ``H = x² y asinh(y/|x|) / 2 + x y² asinh(x/|y|) / 2 - r³ / 6`` (Love
        1929); far away the series ``1/r + (a² d²/dx² + b² d²/dy²)(1/r) / 12`` in the sides a, b.
        """
        dx, ds = cell_mm
        x, s = (np.arange(cells[0] + 1) * dx)[:, None], (np.arange(cells[1] + 1) * ds)[None, :]
        r2 = x**2 + s**2
        r2[0, 0] = 1.0
        found = dx * ds * (1 + (dx**2 * (3 * x**2 - r2) + ds**2 * (3 * s**2 - r2)) / (12 * r2**2)) / np.sqrt(r2)
        x = (np.arange(-1, min(cells[0], NEAR) + 1) * dx)[:, None]
        s = (np.arange(-1, min(cells[1], NEAR) + 1) * ds)[None, :]
        # Where a denominator is zero its factor is, too: the product's limit is 0.
        safe_x, safe_s = np.where(x == 0, 1.0, np.abs(x)), np.where(s == 0, 1.0, np.abs(s))
        potential = 0.5 * x * s * (x * np.arcsinh(s / safe_x) + s * np.arcsinh(x / safe_s)) - np.hypot(x, s) ** 3 / 6
        near = np.diff(np.diff(potential, 2, axis=0), 2, axis=1) / (dx * ds)
        found[: near.shape[0], : near.shape[1]] = near
        return found / (math.pi * self.modulus_mpa)


@dataclass(frozen=True)
class Layer:
    """A layer bonded to a rigid base, frictionless on top, on a periodic domain."""

    young_mpa: float
    poisson: float
    thickness_mm: float

    def compliance(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> tuple[np.ndarray, tuple[int, int]]:
        """Return ``2 M(kh) / (E* k)``, weighted by ``sinc²`` for the means of both cells, and the domain's size.

        Summed over the waves that look alike on the grid, two on either side.
        """
        nu, x, s = self.poisson, np.fft.fftfreq(cells[0])[:, None], np.fft.rfftfreq(cells[1])[None, :]
        found = np.zeros((cells[0], cells[1] // 2 + 1))
        for m in range(-2, 3):
            for n in range(-2, 3):
                k = 2 * math.pi * np.hypot((x + m) / cell_mm[0], (s + n) / cell_mm[1])
                k[0, 0] = k[0, 0] or 1.0
                shape = compliance_shape(k * self.thickness_mm, nu)
                found += np.sinc(x + m) ** 2 * np.sinc(s + n) ** 2 * 2 * shape * (1 - nu**2) / (self.young_mpa * k)
        found[0, 0] = self.thickness_mm * (1 + nu) * (1 - 2 * nu) / (self.young_mpa * (1 - nu))
        return found, cells


@dataclass(frozen=True)
class Pressed:
    """A surface under one load."""

    pressure_mpa: np.ndarray
    displacement_mm: np.ndarray
    depth_mm: float
    """Approach of the indenter, counted from where the gap is zero."""
    contact_radius_mm: float
    """``sqrt(5/2 <r²>)`` about the centre of pressure: exact for Hertz's pressure, where counting cells is not."""


def press(
    kernel: HalfSpace | Layer, gap_mm: np.ndarray, cell_mm: tuple[float, float], force_n: float, tolerance: float = 1e-8
) -> Pressed:
    """Return the surface under a rigid indenter.

    Parameters
    ----------
    kernel
        The elastic surface.
    gap_mm
        (nx, ns) mean distance over each cell at zero approach; infinite where the indenter has no surface.
    cell_mm
        Sides of a cell.
    force_n
        Normal force, above zero.
    tolerance
        Largest change of the pressure over the last iteration, summed and relative to the load.
    """
    cells = gap_mm.shape
    compliance, padded = kernel.compliance(cells, cell_mm)
    reachable, total = np.isfinite(gap_mm), force_n / (cell_mm[0] * cell_mm[1])
    gap = np.where(reachable, gap_mm, 0.0)

    def sunk(pressure: np.ndarray) -> np.ndarray:
        return np.fft.irfft2(np.fft.rfft2(pressure, padded) * compliance, padded)[: cells[0], : cells[1]]

    pressure = np.where(reachable, total / reachable.sum(), 0.0)
    direction, before, keep = np.zeros(cells), 1.0, 0.0
    for _ in range(2000):
        contact = pressure > 0
        residual = sunk(pressure) + gap
        residual -= residual[contact].mean()
        norm = float(np.square(residual[contact]).sum())
        direction = np.where(contact, residual + keep * (norm / before) * direction, 0.0)
        before = norm
        product = sunk(direction)
        product -= product[contact].mean()
        curvature = float(np.vdot(product, direction))
        if curvature <= 0:  # nothing is left to change
            break
        length, old = float(np.vdot(residual, direction)) / curvature, pressure
        pressure = np.maximum(pressure - length * direction, 0.0)
        sinks = reachable & (pressure == 0) & (residual < 0)
        pressure[sinks] = -length * residual[sinks]
        keep = 0.0 if sinks.any() else 1.0
        pressure *= total / pressure.sum()
        if float(np.abs(pressure - old).sum()) <= tolerance * total:
            break
    else:
        raise AssertionError("the boundary elements did not settle")
    displacement = sunk(pressure)
    places = [np.arange(n) * side for n, side in zip(cells, cell_mm, strict=True)]
    weights = [pressure.sum(axis=1 - axis) / total for axis in (0, 1)]
    # The last term is a cell's own: pressure is even on it.
    moment = sum(
        float(w @ at**2) - float(w @ at) ** 2 + side**2 / 12
        for w, at, side in zip(weights, places, cell_mm, strict=True)
    )
    depth = float((displacement + gap)[pressure > 0].mean())
    return Pressed(pressure, displacement, depth, math.sqrt(2.5 * moment))


def paraboloid_mm(
    cells: int, side_mm: float, radius_mm: float = 10.0, x_mm: float = 0.0, s_mm: float = 0.0
) -> np.ndarray:
    """Return the (cells, cells) mean gap ``r²/2R`` under an apex, on a square domain around zero."""
    x = (np.arange(cells) + 0.5) * (side_mm / cells) - side_mm / 2
    mean = (side_mm / cells) ** 2 / 6
    return ((x[:, None] - x_mm) ** 2 + (x[None, :] - s_mm) ** 2 + mean) / (2 * radius_mm)


def pressed(kernel: HalfSpace | Layer, gap_mm: np.ndarray, side_mm: float, force_n: float) -> Pressed:
    """Return the surface under a gap on a square domain."""
    return press(kernel, gap_mm, (side_mm / gap_mm.shape[0],) * 2, force_n)
