"""A linear elastic layer bonded to a rigid base: its response to waves of pressure and traction, and its medium."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import BondedLayer, SkinGrid
from tactbench.rigs.twin.contact.media import Medium, Spectrum

_SERIES_BELOW = 0.35
"""Limit of q below which the numerator is summed as a series, because ``sinh y - y`` would cancel."""
_TERMS = 8


def compliance_shape(q: FloatArray, poisson: float) -> FloatArray:
    """Return ``M(q)``, the compliance of the layer relative to a half-space, for ``q = k h``.

    ``M = [(3-4nu) sinh 2q - 2q] / [(3-4nu) cosh 2q + 2q² + 5 - 12nu + 8nu²]``: 1 for short waves,
    ``q (1-2nu) / (2 (1-nu)²)`` for long ones (Winkler), ``2 q³ / 3`` for an incompressible layer. Valid for every
    q >= 0 and 0 <= nu <= 1/2. A wave of pressure of amplitude p sinks by ``2 M p / (E* k)``.
    """
    q = np.asarray(q, dtype=np.float64)
    a, c = 3 - 4 * poisson, 5 - 12 * poisson + 8 * poisson**2
    small = q < _SERIES_BELOW
    y = 2 * np.where(small, q, 0.0)
    term = y**3 / 6
    series = term.copy()
    for n in range(2, _TERMS + 1):
        term = term * y**2 / ((2 * n) * (2 * n + 1))
        series += term
    # (3-4nu) sinh y - y = (3-4nu) (sinh y - y) + (2-4nu) y, whose last factor is exactly 0 at nu = 1/2.
    low = (a * series + (2 - 4 * poisson) * y) / (a * np.cosh(y) + y**2 / 2 + c)
    big = np.where(small, 1.0, q)
    decay, decay2 = np.exp(-2 * big), np.exp(-4 * big)
    high = (a * (1 - decay2) / 2 - 2 * big * decay) / (a * (1 + decay2) / 2 + (2 * big**2 + c) * decay)
    return np.asarray(np.where(small, low, high))


def shear_shapes(q: FloatArray, poisson: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return two tangential compliances of the layer's surface under waves, times ``G k``, as functions of ``q = k h``.

    - under pressure, along the wave: ``C = [(1-2nu) (3-4nu) (cosh 2q - 1) - 2q²] / 2D``. A wave of pressure
      ``p cos kx`` moves the surface by ``-C p sin kx / (G k)``: towards the pressed place where C > 0. C is 0.5 - nu
      for short waves (Boussinesq), ``-q²/2`` for long ones in an incompressible layer, whose material flows away;
    - under a traction along the wave: ``(1-nu) [(3-4nu) sinh 2q + 2q] / D``, 1 - nu for short waves;
    - under a traction along the crests: ``tanh q``, 1 for short waves.

    D is the denominator of :func:`compliance_shape`. For long waves both tractions give ``q``: simple shear.
    """
    q = np.asarray(q, dtype=np.float64)
    a, c = 3 - 4 * poisson, 5 - 12 * poisson + 8 * poisson**2
    # Numerators and D times e^-2q.
    decay = np.exp(-2 * q)
    denominator = a * (1 + decay**2) / 2 + (2 * q**2 + c) * decay
    squeezed = ((1 - 2 * poisson) * a * np.expm1(-2 * q) ** 2 / 2 - 2 * q**2 * decay) / (2 * denominator)
    along = (1 - poisson) * (-a * np.expm1(-4 * q) / 2 + 2 * q * decay) / denominator
    return squeezed, along, np.tanh(q)


def medium(skin: BondedLayer, grid: SkinGrid) -> Medium:
    """Return the layer of thickness h as a medium of stiffness ``K = E* k / (2 M(k h))`` at wavenumber k on `grid`.

    For a uniform pressure it is ``E_oed / h``. The mean deflection of an incompressible layer is zero.
    """
    young, poisson, thickness = skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm")
    spectrum = Spectrum(grid)
    k = np.sqrt(spectrum.k2)
    k[0, 0] = 1.0
    stiffness = young / (1 - poisson**2) * k / (2 * compliance_shape(k * thickness, poisson))
    incompressible = poisson == 0.5
    oedometric = 0.0 if incompressible else young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    stiffness[0, 0] = oedometric / thickness
    return Medium(
        grid=grid,
        spectrum=spectrum,
        stiffness=stiffness,
        respond=_no_local_law,
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        zero_mean=incompressible,
        rest_thickness_mm=np.full(spectrum.shape, thickness),
        least_thickness_mm=0.0,
        low_modes=80,
    )


def _no_local_law(deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
    """Return no pressure: the law of a medium whose whole stiffness is in the Fourier modes."""
    tangent.fill(0.0)
    return np.zeros_like(deflection_mm), 0.0
