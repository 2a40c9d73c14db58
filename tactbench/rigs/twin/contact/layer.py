"""A linear elastic layer bonded to a rigid base, of any Poisson ratio, 1/2 included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactbench.plugin import BondedLayer, FloatArray, RigError, SkinGrid
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.geometry import wave_numbers

SERIES_BELOW = 0.35
"""k h below which the kernel is summed as a series: the closed form cancels there."""


@dataclass(frozen=True)
class Nothing:
    """No local law: all is in the kernel."""

    def energy(self, w: FloatArray) -> FloatArray:
        """Return zero."""
        return np.zeros_like(w)

    pressure = energy
    tangent = energy


def layer_kernel(q: FloatArray, nu: float) -> FloatArray:
    """Return M(q), q = k h, of ``u^ = 2/(E* k) M p^`` for a frictionless top on a bonded base.

    ``M = [(3-4nu) sinh 2q - 2q] / [(3-4nu) cosh 2q + 2q² + 5 - 12nu + 8nu²]``, evaluated so that nothing cancels for
    small q (a series for ``sinh y - y``) and nothing overflows for large q (multiplied through by ``exp(-2q)``).

    Raises
    ------
    RigError
        If `nu` is not in 0 … 0.5.
    """
    if not 0.0 <= nu <= 0.5:
        raise RigError(f"A Poisson ratio of {nu} cannot be.", hint="It lies between 0 and 0.5.")
    a, c = 3.0 - 4.0 * nu, 5.0 - 12.0 * nu + 8.0 * nu**2
    y = 2.0 * np.minimum(q, SERIES_BELOW)
    term = y**3 / 6.0
    series = term.copy()
    for n in range(2, 9):
        term = term * y**2 / ((2 * n) * (2 * n + 1))
        series += term
    small = (a * series + (2.0 - 4.0 * nu) * y) / (a * np.cosh(y) + y**2 / 2.0 + c)
    large_q = np.maximum(q, SERIES_BELOW)
    decay = np.exp(-2.0 * large_q)
    large = (a * (1.0 - decay**2) / 2.0 - 2.0 * large_q * decay) / (
        a * (1.0 + decay**2) / 2.0 + (2.0 * large_q**2 + c) * decay
    )
    return np.where(q < SERIES_BELOW, small, large)


def layer(skin: BondedLayer, grid: SkinGrid) -> Medium:
    """Return `skin` on `grid`: ``K(k) = E* k / (2 M(k h))``, at k = 0 the oedometric ``E_oed / h``."""
    young, nu, h = skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm")
    kx, ks = wave_numbers(grid)
    k = np.sqrt(kx**2 + ks**2)
    plane = young / (1.0 - nu**2)
    incompressible = nu == 0.5
    at_zero = 0.0 if incompressible else young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / h
    safe = np.where(k > 0, k, 1.0)
    stiffness = np.where(k > 0, plane * safe / (2.0 * layer_kernel(safe * h, nu)), at_zero)
    return Medium(
        grid=grid,
        stiffness=stiffness,
        law=Nothing(),
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        keeps_volume=incompressible,
        outer_radius_mm=skin.sheet.outer_radius.to("mm") if skin.sheet.outer_radius else np.inf,
        rest_thickness_mm=np.full((len(grid.x_mm), len(grid.s_mm)), h),
        least_thickness_mm=0.0,
    )
