"""A hardening foam under a thin cover: the iCub fingertip's kind of skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, FoamPad, SkinGrid
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.geometry import wave_numbers

FROZEN_AT = 0.97
"""Share of the densification strain beyond which the tangent stays what it is: bottoming out never divides by zero."""
MARGIN_STRENGTH = 1e-2
"""Stiffness of the soft margin around the pad, relative to the pad."""
LEAST_SHARE = 0.05
"""Share of the foam's thickness that no load closes, for the capacitance."""


@dataclass(frozen=True)
class HardeningFoam:
    """``p(u) = k0 u / (1 - |u|/um)``, odd in u; linear with the last tangent beyond ``0.97 um``."""

    k0: float
    um: float
    strength: FloatArray

    def energy(self, w: FloatArray) -> FloatArray:
        """Return the energy density, ``um² k0 (-xi - ln(1 - xi))`` below the freeze, quadratic above."""
        xi = np.minimum(np.abs(w) / self.um, FROZEN_AT)
        over = np.maximum(np.abs(w) - FROZEN_AT * self.um, 0.0)
        below = self.um**2 * self.k0 * (-xi - np.log1p(-xi))
        last_p = self.k0 * FROZEN_AT * self.um / (1 - FROZEN_AT)
        last_t = self.k0 / (1 - FROZEN_AT) ** 2
        return np.asarray(self.strength * (below + last_p * over + 0.5 * last_t * over * over))

    def pressure(self, w: FloatArray) -> FloatArray:
        """Return its derivative."""
        size = np.minimum(np.abs(w), FROZEN_AT * self.um)
        over = np.abs(w) - size
        below = self.k0 * size / (1.0 - size / self.um)
        return np.asarray(self.strength * np.sign(w) * (below + self.k0 / (1 - FROZEN_AT) ** 2 * over))

    def tangent(self, w: FloatArray) -> FloatArray:
        """Return its second derivative."""
        xi = np.minimum(np.abs(w) / self.um, FROZEN_AT)
        return np.asarray(self.strength * self.k0 / (1.0 - xi) ** 2)


def foam(skin: FoamPad, grid: SkinGrid) -> Medium:
    """Return `skin` on `grid`: ``K(k) = (G h/3 + T) k² + D k⁴`` (Pasternak shear and cover) over a hardening foam."""
    h = skin.thickness.to("mm")
    kx, ks = wave_numbers(grid)
    k2 = kx**2 + ks**2
    shear = skin.shear.to("MPa") * h / 3.0 + skin.cover_tension.to("N/mm")
    law = HardeningFoam(skin.young.to("MPa") / h, skin.densification.to("1") * h, _strength(skin, grid))
    return Medium(
        grid=grid,
        stiffness=shear * k2 + skin.cover_bending.to("N*mm") * k2**2,
        law=law,
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        keeps_volume=False,
        outer_radius_mm=skin.sheet.outer_radius.to("mm") if skin.sheet.outer_radius else np.inf,
        rest_thickness_mm=np.full((len(grid.x_mm), len(grid.s_mm)), h),
        least_thickness_mm=LEAST_SHARE * h,
    )


def _strength(skin: FoamPad, grid: SkinGrid) -> FloatArray:
    if skin.sheet.pad is None:
        return np.ones((len(grid.x_mm), len(grid.s_mm)))
    x_min, x_max, arc = (quantity.to("mm") for quantity in skin.sheet.pad)
    x, s = grid.x_mm[:, None], grid.s_mm[None, :]
    return np.where((x >= x_min) & (x <= x_max) & (np.abs(s) <= arc / 2), 1.0, MARGIN_STRENGTH)
