"""Media, the interface of skins to the solver: a stiffness per Fourier mode and a local law; foam pad and bonded layer.

Conversion between fields of the skin and flat real vectors of their Fourier coefficients, which are scaled so that the
dot product of two vectors is the sum over cells of the product of the fields: energy, gradient and conjugate directions
are computed in Fourier space, where the skin's own stiffness is a diagonal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import BondedLayer, FoamPad, SkinGrid
from tactbench.rigs.twin.geometry import skin_grid


class Spectrum:
    """Fourier transforms on one grid, of a periodic sheet or of a sheet mirrored at both ends along x.

    Along x, fields of a mirrored sheet are sums of cosines and continue as their own images.
    """

    def __init__(self, grid: SkinGrid, *, mirrored: bool = False) -> None:
        self.shape = (grid.x_mm.size, grid.s_mm.size)
        self.mirrored = mirrored
        nx, ns = self.shape
        self.half = (nx, ns // 2 + 1)
        self.size = 2 * self.half[0] * self.half[1]
        """Number of coefficients in a flat vector."""
        dx, ds = grid.cell_mm
        self.area_mm2 = dx * ds
        """Area of one cell of the grid."""
        kx = np.pi / (nx * dx) * np.arange(nx) if mirrored else 2 * np.pi * np.fft.fftfreq(nx, dx)
        ks = 2 * np.pi * np.fft.rfftfreq(ns, ds)
        self.kx = kx[:, None]
        """(nx, 1) wave numbers of the modes along x, 1/mm."""
        self.k2 = self.kx**2 + ks**2
        """(nx, ns//2+1) squared wave numbers of the modes, 1/mm²."""
        # Columns between the first and the last stand for themselves and their conjugates.
        weight = np.full((1, self.half[1]), math.sqrt(2.0))
        weight[0, 0] = 1.0
        if ns % 2 == 0:
            weight[0, -1] = 1.0
        root = math.sqrt(ns if mirrored else nx * ns)
        if mirrored:
            self._cosines = math.sqrt(2.0 / nx) * np.cos(np.pi / nx * np.outer(np.arange(nx), np.arange(nx) + 0.5))
            self._cosines[0] *= math.sqrt(0.5)
        self._forward = weight / root
        self._backward = root / weight
        self._buffer = np.empty(self.half, dtype=np.complex128)

    def of(self, field: FloatArray) -> FloatArray:
        """Return the (size,) vector of a (nx, ns) field."""
        # Numpy's transforms are as quick as scipy's, whose package takes 40 ms to import.
        coefficients = np.fft.rfft(self._cosines @ field) if self.mirrored else np.fft.fft(np.fft.rfft(field), axis=0)
        coefficients *= self._forward
        # NumPy 1.26 returns the transform along the first axis in column order.
        flat: FloatArray = np.ascontiguousarray(coefficients).view(np.float64).reshape(-1)
        return flat

    def field(self, vector: FloatArray) -> FloatArray:
        """Return the (nx, ns) field of a (size,) vector."""
        np.multiply(vector.view(np.complex128).reshape(self.half), self._backward, out=self._buffer)
        if self.mirrored:
            return self._cosines.T @ np.fft.irfft(self._buffer, self.shape[1])
        real: FloatArray = np.fft.irfft(np.fft.ifft(self._buffer, axis=0), self.shape[1])
        return real

    def diagonal(self, multiplier: FloatArray) -> FloatArray:
        """Return the (size,) factors that act on a flat vector as the (nx, ns//2+1) `multiplier` acts on the modes."""
        return np.repeat(multiplier.reshape(-1), 2)


class LowModes:
    """The softest Fourier modes as an orthonormal real basis, in which a varying stiffness is a small matrix.

    A local stiffness D(x) couples modes k and k' by its own Fourier coefficients at ``k - k'`` and ``k + k'``; so
    the matrix is assembled from one transform of D, without integration.
    """

    def __init__(self, medium: Medium) -> None:
        spectrum, stiffness = medium.spectrum, medium.stiffness
        nx, ns = spectrum.shape
        nh = spectrum.half[1]
        rows, columns = np.meshgrid(np.arange(nx), np.arange(nh), indexing="ij")
        signed = rows if spectrum.mirrored else np.where(rows > nx // 2, rows - nx, rows)
        # One of each pair of conjugates, and no mode at the Nyquist rim, where cosine and sine coincide.
        free = ((columns > 0) | (signed > 0)) & (2 * columns < ns)
        free &= spectrum.mirrored | (2 * np.abs(signed) < nx)
        chosen = np.flatnonzero(free)
        order = np.argsort(stiffness.reshape(-1)[chosen], kind="stable")
        chosen = np.sort(chosen[order[: medium.low_modes]])
        m, n = signed.reshape(-1)[chosen], columns.reshape(-1)[chosen]
        self._modes = chosen.size
        self._mean = not medium.zero_mean
        self.size = 2 * self._modes + int(self._mean)
        """Number of basis functions: cosines, sines and, unless the mean is held at zero, the constant."""
        apart, together = m[:, None] - m, m[:, None] + m
        less, more = (n[:, None] - n) % ns, (n[:, None] + n) % ns
        # On a periodic sheet modes of the first column are stored twice, as k and -k, each with half of the weight.
        twice, norm, self._along = n == 0, np.ones(m.size), None
        ways = np.stack([apart % nx, together % nx])[:, None]
        if spectrum.mirrored:
            # In a product of cosines along x both wave numbers go with either one along s. Modes of the first column
            # and row have norms of their own; one without a wave along s has no sine, only the row of one.
            twice = n < 0
            ways = np.broadcast_to(np.stack([np.abs(apart), together]), (2, 2, *apart.shape))
            self._along = np.cos(np.pi / nx * np.outer(np.arange(together.max() + 1), np.arange(nx) + 0.5))
            norm = np.where(m > 0, 1.0, math.sqrt(0.5)) * np.where(n > 0, 1.0, math.sqrt(0.5))
        self._places_apart, self._places_together = ways[0] * ns + less, ways[1] * ns + more
        self._norms, self._own, self._own_norm = (
            np.outer(norm, norm),
            m % nx * ns + n,
            norm * math.sqrt(2.0 * len(ways[0])),
        )
        doubled = np.where(twice, math.sqrt(2.0), 1.0)
        constant = int(self._mean)
        self._places = np.concatenate([2 * chosen, 2 * chosen + 1, np.zeros(constant, dtype=np.intp)])
        self._scales = np.concatenate([doubled, doubled, np.ones(constant)])
        pairs = np.flatnonzero(twice)
        mirror = ((-m[pairs]) % nx) * nh
        self._mirror_places = np.concatenate([2 * mirror, 2 * mirror + 1])
        self._mirror_from = np.concatenate([pairs, self._modes + pairs])
        root = math.sqrt(0.5)
        self._mirror_scales = np.concatenate([np.full(pairs.size, root), np.full(pairs.size, -root)])
        self._cells = nx * ns
        flat = stiffness.reshape(-1)
        self._stiffness = np.concatenate([flat[chosen], flat[chosen], flat[:constant]])

    def take(self, vector: FloatArray) -> FloatArray:
        """Return the (size,) coefficients of the low modes in a flat vector."""
        return np.asarray(vector[self._places] * self._scales)

    def put(self, coefficients: FloatArray, vector: FloatArray) -> None:
        """Overwrite the low modes of a flat vector by their (size,) coefficients."""
        vector[self._places] = coefficients / self._scales
        vector[self._mirror_places] = coefficients[self._mirror_from] * self._mirror_scales

    def matrix(self, local: FloatArray, out: FloatArray) -> None:
        """Fill ``out[:size, :size]`` with the matrix of ``K + local`` for a (nx, ns) local stiffness."""
        moments = np.fft.fft2(local) if self._along is None else np.fft.fft(self._along @ local)
        moments = moments.reshape(-1) / self._cells
        difference, total = (
            moments[places].sum(axis=0) * self._norms for places in (self._places_apart, self._places_together)
        )
        n = self._modes
        # Coefficient at q: sum D cos(qx) - i sum D sin(qx), over the number of cells.
        np.add(difference.real, total.real, out=out[:n, :n])
        np.subtract(difference.real, total.real, out=out[n : 2 * n, n : 2 * n])
        # The stored sine coefficient is minus the sine's own: out[n+i, j] = -<sin_i, D cos_j>.
        np.add(total.imag, difference.imag, out=out[n : 2 * n, :n])
        out[:n, n : 2 * n] = out[n : 2 * n, :n].T
        if self._mean:
            own = moments[self._own] * self._own_norm
            out[2 * n, :n], out[2 * n, n : 2 * n] = own.real, own.imag
            out[:n, 2 * n], out[n : 2 * n, 2 * n] = own.real, own.imag
            out[2 * n, 2 * n] = moments[0].real
        diagonal = np.einsum("ii->i", out[: self.size, : self.size])
        diagonal += self._stiffness


LocalLaw = Callable[[FloatArray, FloatArray], tuple[FloatArray, float]]
"""Function from the (nx, ns) deflection of cells [mm], independent of other cells, to their (nx, ns) restoring pressure
[MPa] (a new array) and the summed energy density [N/mm]; it fills its second argument with the (nx, ns) derivative of
the pressure [MPa/mm]."""


@dataclass(frozen=True)
class Medium:
    """Mechanical properties of a skin on a grid, in mm, N and MPa."""

    grid: SkinGrid
    spectrum: Spectrum
    stiffness: FloatArray
    """(nx, ns//2+1) pressure per deflection of each mode [MPa/mm]."""
    respond: LocalLaw
    contact_stiffness: float
    """Stiffness of the contact between indenter and skin [MPa/mm]."""
    zero_mean: bool
    """True if the volume under the skin is constant, so that the mean deflection is zero."""
    rest_thickness_mm: FloatArray
    """(nx, ns) thickness [mm] of the fluid film or layer without contact."""
    least_thickness_mm: float
    """Thickness of the film that remains when the skin is pressed onto the core; 0 for a skin without such a limit."""
    low_modes: int
    """Number of mode pairs that the preconditioner solves exactly: chosen for speed, without effect on the result."""
    contact_updates: int = 0
    """Number of corrections for the penetration of a contact penalty; 0 if the contact stiffness is a skin property."""
    has_core: bool = False
    """True if a core carries load where less than `least_thickness_mm` of the film would be left."""

    def closing_mm(self, deflection_mm: FloatArray) -> float:
        """Return the distance by which the skin passes the least film thickness; above 0 it touches the core."""
        return float(np.max(deflection_mm - self.rest_thickness_mm)) + self.least_thickness_mm

    def thickness_mm(self, deflection_mm: FloatArray) -> FloatArray:
        """Return the (nx, ns) remaining thickness of the film or layer."""
        left = self.rest_thickness_mm - deflection_mm
        return np.maximum(left, self.least_thickness_mm) if self.has_core else left


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


def foam_medium(skin: FoamPad, grid: SkinGrid) -> Medium:
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


_SERIES_BELOW = 0.35
"""Limit of q below which the numerator is summed as a series, because ``sinh y - y`` would cancel."""
_TERMS = 8


def compliance_shape(q: FloatArray, poisson: float) -> FloatArray:
    """Return ``M(q)``, the compliance of the layer relative to a half-space, for ``q = k h``.

    ``M = [(3-4nu) sinh 2q - 2q] / [(3-4nu) cosh 2q + 2q² + 5 - 12nu + 8nu²]``: 1 for short waves,
    ``q (1-2nu) / (2 (1-nu)²)`` for long ones (Winkler), ``2 q³ / 3`` for an incompressible layer. Valid for every
    q >= 0 and 0 <= nu <= 1/2. A wave of pressure of amplitude p sinks by ``2 M p / (E* k)``.
    """
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
    a, c = 3 - 4 * poisson, 5 - 12 * poisson + 8 * poisson**2
    # Numerators and D times e^-2q.
    decay = np.exp(-2 * q)
    denominator = a * (1 + decay**2) / 2 + (2 * q**2 + c) * decay
    squeezed = ((1 - 2 * poisson) * a * np.expm1(-2 * q) ** 2 / 2 - 2 * q**2 * decay) / (2 * denominator)
    along = (1 - poisson) * (-a * np.expm1(-4 * q) / 2 + 2 * q * decay) / denominator
    return squeezed, along, np.tanh(q)


def layer_medium(skin: BondedLayer, grid: SkinGrid) -> Medium:
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
