"""A sleeve around an incompressible fluid over a rigid core: the BioTac's kind of skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, FluidBackedShell, SkinGrid
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.geometry import wave_numbers


@dataclass(frozen=True)
class ClampAndCore:
    """A soft clamp along the sleeve's border, and the core once the film is closed."""

    clamp: FloatArray
    core_stiffness: float
    core_at: FloatArray

    def energy(self, w: FloatArray) -> FloatArray:
        """Return ``c w²/2 + k (w - w_core)²/2`` where the core is met."""
        over = np.maximum(w - self.core_at, 0.0)
        return np.asarray(0.5 * (self.clamp * w * w + self.core_stiffness * over * over))

    def pressure(self, w: FloatArray) -> FloatArray:
        """Return its derivative."""
        return np.asarray(self.clamp * w + self.core_stiffness * np.maximum(w - self.core_at, 0.0))

    def tangent(self, w: FloatArray) -> FloatArray:
        """Return its second derivative."""
        return np.asarray(self.clamp + self.core_stiffness * (w > self.core_at))


def shell(skin: FluidBackedShell, grid: SkinGrid) -> Medium:
    """Return `skin` on `grid`: a shallow circular cylindrical shell (Donnell, Mushtari, Vlasov).

    ``K(k) = D k⁴ + T k² + (E t / Rm²) kx⁴ / k⁴`` with ``D = E t³ / (12 (1 - nu²))``; the mean is left to the fluid.
    """
    young, nu, t = skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm")
    kx, ks = wave_numbers(grid)
    k2 = kx**2 + ks**2
    bending = young * t**3 / (12.0 * (1.0 - nu**2))
    arch = young * t / skin.mid_radius.to("mm") ** 2
    safe = np.where(k2 > 0, k2, 1.0)
    stiffness = np.where(k2 > 0, bending * k2**2 + skin.tension.to("N/mm") * k2 + arch * (kx**2 / safe) ** 2, 0.0)
    outer = skin.sheet.outer_radius.to("mm") if skin.sheet.outer_radius else np.inf
    film = film_at_rest_mm(skin, grid)
    residual = skin.residual_film.to("mm")
    core_at = film - residual
    return Medium(
        grid=grid,
        stiffness=stiffness,
        law=ClampAndCore(_clamp(skin, grid), skin.core_stiffness.to("MPa/mm"), core_at),
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        keeps_volume=True,
        outer_radius_mm=outer,
        rest_thickness_mm=film,
        least_thickness_mm=residual,
        core_at_mm=core_at,
    )


def film_at_rest_mm(skin: FluidBackedShell, grid: SkinGrid) -> FloatArray:
    """Return the film thickness at rest, (nx, ns).

    ``max(gap (1 - f c²), side)`` with ``c = clip(|theta| - 0.6, 0, 1)``: fitted by eye to the public meshes of the
    BioTac's core and inner skin (assumed).
    """
    outer = skin.sheet.outer_radius.to("mm") if skin.sheet.outer_radius else np.inf
    c = np.clip(np.abs(grid.s_mm / outer) - 0.6, 0.0, 1.0)
    film = np.maximum(skin.gap.to("mm") * (1.0 - skin.gap_side_fraction.to("1") * c**2), skin.gap_side.to("mm"))
    return np.broadcast_to(film, (len(grid.x_mm), len(grid.s_mm))).copy()


def _clamp(skin: FluidBackedShell, grid: SkinGrid) -> FloatArray:
    length, strength = skin.clamp_length.to("mm"), skin.clamp_stiffness.to("MPa/mm")
    x_min, x_max, arc = (q.to("mm") for q in (skin.sheet.x_min, skin.sheet.x_max, skin.sheet.arc))
    x = grid.x_mm[:, None]
    ends = np.maximum(np.exp(-(x - x_min) / length), np.exp(-(x_max - x) / length))
    seam = np.exp(-(arc / 2 - np.abs(grid.s_mm[None, :])) / length)
    return np.asarray(strength * (ends + seam))
