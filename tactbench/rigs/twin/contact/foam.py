"""Model of the skin of the iCub's fingertip: a hardening foam under a thin cover."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import FoamPad, SkinGrid
from tactbench.rigs.twin.contact.media import Medium, Spectrum
from tactbench.rigs.twin.geometry import skin_grid

CUT_OVER = 0.97
"""Share of the densification strain beyond which the law is continued by its tangent, to avoid a division by zero."""
OUTSIDE_THE_PAD = 1e-2
"""Stiffness of the sheet's margin outside the foam pad, relative to the stiffness of the foam."""


CONTACT_UPDATES = 2
"""Number of corrections for the penetration that the contact penalty allows. With two, ten times the iCub's contact
stiffness changes no taxel by more than 0.08 counts (18 contacts, 5 mm to flat, 0.1 to 5 N); without, by up to 1.6."""


class Foam:
    """``p(u) = k0 u / (1 - |u|/u_m)``, continued linearly in pressure beyond 97 % of ``u_m``."""

    def __init__(self, k0: float, limit_mm: float, weight: FloatArray) -> None:
        self._k0 = k0
        self._limit = limit_mm
        self._weight = weight

    def __call__(self, deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
        """Return the (nx, ns) restoring pressure [MPa] and the summed energy density [N/mm]; fill `tangent`."""
        share = np.abs(deflection_mm)
        share /= self._limit
        beyond = None
        if share.max() > CUT_OVER:
            beyond = np.maximum(share - CUT_OVER, 0.0)
            np.minimum(share, CUT_OVER, out=share)
        open_ = 1.0 - share
        density = -share - np.log1p(-share)
        pressure = share / open_
        np.multiply(open_, open_, out=open_)
        np.reciprocal(open_, out=tangent)
        if beyond is not None:
            density += beyond * (pressure + 0.5 * beyond * tangent)
            pressure += beyond * tangent
        tangent *= self._k0
        tangent *= self._weight
        pressure *= self._k0 * self._limit
        pressure *= self._weight
        np.copysign(pressure, deflection_mm, out=pressure)
        energy = self._k0 * self._limit**2 * float(density.reshape(-1) @ self._weight.reshape(-1))
        return pressure, energy


def _covered(centres: FloatArray, own: FloatArray, low: float, high: float) -> FloatArray:
    """Return the (n,) shares, 0 to 1, of cells with (n,) `centres` that lie within a pad from `low` to `high`.

    The pad ends at the outer edges of the sheet's `own` cells with their centres inside: the same on every grid, so
    that finer grids converge to the pad of the solver's reference figures.
    """
    step, half = float(centres[1] - centres[0]), float(own[1] - own[0]) / 2
    inside = own[(own >= low) & (own <= high)]
    ends = np.minimum(centres + step / 2, inside[-1] + half) - np.maximum(centres - step / 2, inside[0] - half)
    return np.asarray(np.clip(ends / step, 0.0, 1.0))


def medium(skin: FoamPad, grid: SkinGrid) -> Medium:
    """Return the medium of a foam pad on `grid`.

    Its modes hold Pasternak shear and the cover, ``K = (G h / 3 + T) k² + D k⁴``; its local law is the hardening foam.
    """
    young, thickness = skin.young.to("MPa"), skin.thickness.to("mm")
    spectrum = Spectrum(grid)
    shear = skin.shear.to("MPa") * thickness / 3 + skin.cover_tension.to("N/mm")
    stiffness = shear * spectrum.k2 + skin.cover_bending.to("N*mm") * spectrum.k2**2
    weight = np.ones(spectrum.shape)
    if skin.sheet.pad is not None:
        low, high, arc = (edge.to("mm") for edge in skin.sheet.pad)
        own = skin_grid(skin.sheet)
        along = _covered(grid.x_mm, own.x_mm, low, high)
        across = _covered(grid.s_mm, own.s_mm, -arc / 2, arc / 2)
        inside = along[:, None] * across[None, :]
        weight = OUTSIDE_THE_PAD + (1.0 - OUTSIDE_THE_PAD) * inside
    return Medium(
        grid=grid,
        spectrum=spectrum,
        stiffness=stiffness,
        respond=Foam(young / thickness, skin.densification.to("1") * thickness, weight),
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        zero_mean=False,
        rest_thickness_mm=np.full(spectrum.shape, thickness),
        least_thickness_mm=0.0,
        low_modes=80,
        contact_updates=CONTACT_UPDATES,
    )
