"""What is pressed: how far a surface sinks under pressure elsewhere. Millimetres, newtons, megapascals.

Pressure is constant on each cell, and what counts is the mean displacement of each cell (a Galerkin method): the
energy is then exact for the pressures that the grid can hold, and the depth under a paraboloid converges with about the
third power of the cell, where displacements at the centres converge with the second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.layer_kernel import compliance_shape

_NEAR = 48
"""Cells up to which the closed form is used: its cancellation costs (r/cell)⁴ roundings, 4e-9 there."""
_ALIASES = 2
_THICK = 12.0
"""Waves of ``k h`` above this see a half-space: the layer's compliance differs from it by ``q² e^-2q``, 5e-9."""


class Kernel(Protocol):
    """A linear elastic surface without friction. Implementations are frozen, so that transforms can be kept."""

    @property
    def periodic(self) -> bool:
        """Whether the domain repeats itself; else pressure outside the domain is zero."""

    def __hash__(self) -> int: ...

    def influence(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
        """Return the mean displacement [mm/MPa] of the cell (i, j) cells away from one under unit pressure, i, j >= 0.

        Even in both offsets. As large as any window of the domain needs.
        """

    def stiffness(self, wave_number: FloatArray) -> FloatArray:
        """Return the pressure per displacement [MPa/mm] of waves of number > 0 [1/mm]."""


@dataclass(frozen=True)
class HalfSpace:
    """An elastic half-space; pressure is constant on each cell and zero outside the domain."""

    modulus_mpa: float
    """Plane strain modulus ``E* = E / (1 - nu²)``."""
    periodic: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _require(self.modulus_mpa > 0 and math.isfinite(self.modulus_mpa), "modulus", self.modulus_mpa, "positive")

    def influence(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
        """Return the (nx, ns) mean over one cell of ``1 / (pi E* r)``, integrated over the other (Boussinesq).

        Love's integral over the pressed cell (Love 1929; Johnson 1985, eq. 3.25), integrated once more over the other
        cell, is a second difference in both directions of
        ``H = x² y asinh(y/|x|) / 2 + x y² asinh(x/|y|) / 2 - r³ / 6``. Beyond `_NEAR` cells, where that difference
        would cancel, the series ``1/r + (a² d²/dx² + b² d²/dy²)(1/r) / 12`` in the sides a, b; both are good to 1e-8
        where they meet.
        """
        dx, ds = cell_mm
        x, s = (np.arange(cells[0]) * dx)[:, None], (np.arange(cells[1]) * ds)[None, :]
        r2 = x**2 + s**2
        r2[0, 0] = 1.0
        bend = (dx**2 * (3 * x**2 - r2) + ds**2 * (3 * s**2 - r2)) / (12 * r2**2)
        influence: FloatArray = dx * ds * (1 + bend) / np.sqrt(r2)
        near = _second_difference(_second_difference(_potential(cells, cell_mm)).T).T / (dx * ds)
        influence[: near.shape[0], : near.shape[1]] = near
        return influence / (math.pi * self.modulus_mpa)

    def stiffness(self, wave_number: FloatArray) -> FloatArray:
        """Return ``E* k / 2`` (Johnson 1985, section 13.2)."""
        return 0.5 * self.modulus_mpa * wave_number


@dataclass(frozen=True)
class Layer:
    """An elastic layer bonded to a rigid base, frictionless on top, on a periodic domain.

    The domain must be several contact radii plus several thicknesses wide, for its images not to be felt.
    """

    young_mpa: float
    poisson: float
    """0 to 0.5, both included; at 0.5 the mean displacement is zero whatever the pressure."""
    thickness_mm: float
    periodic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _require(self.young_mpa > 0 and math.isfinite(self.young_mpa), "Young's modulus", self.young_mpa, "positive")
        _require(0 <= self.poisson <= 0.5, "Poisson's ratio", self.poisson, "between 0 and 0.5")
        _require(self.thickness_mm > 0 and math.isfinite(self.thickness_mm), "thickness", self.thickness_mm, "positive")

    @property
    def modulus_mpa(self) -> float:
        """Plane strain modulus ``E / (1 - nu²)``."""
        return self.young_mpa / (1 - self.poisson**2)

    @property
    def uniform_compliance(self) -> float:
        """Displacement per uniform pressure [mm/MPa]: thickness over oedometric modulus; 0 if incompressible."""
        nu = self.poisson
        return self.thickness_mm * (1 + nu) * (1 - 2 * nu) / (self.young_mpa * (1 - nu))

    def influence(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
        """Return the (nx//2+1, ns//2+1) periodic influence.

        Its transform is the compliance ``2 M(kh) / (E* k)``, weighted by ``sinc²`` in both directions for the means
        over both cells, and summed over the waves that look alike on the grid (`_ALIASES` on either side: what is
        left out is below 1 % of the shortest wave's compliance and nothing of the longest's).
        """
        from scipy import fft

        x = math.pi * np.fft.fftfreq(cells[0])[:, None]
        s = math.pi * np.fft.rfftfreq(cells[1])[None, :]
        # Waves that only look like those of the grid are short: the layer is a half-space to them, unless it is thin.
        thick = math.pi * self.thickness_mm / max(cell_mm) > _THICK
        compliance = np.zeros((cells[0], cells[1] // 2 + 1))
        for m in range(-_ALIASES, _ALIASES + 1):
            for n in range(-_ALIASES, _ALIASES + 1):
                along, across = x + math.pi * m, s + math.pi * n
                k = np.hypot(2 * along / cell_mm[0], 2 * across / cell_mm[1])
                k[0, 0] = k[0, 0] or 1.0
                weight = np.sinc(along / math.pi) ** 2 * np.sinc(across / math.pi) ** 2
                weight /= 0.5 * self.modulus_mpa * k if thick and (m or n) else self.stiffness(k)
                compliance += weight
        compliance[0, 0] = self.uniform_compliance
        influence: FloatArray = fft.irfft2(compliance, s=cells)
        return influence[: cells[0] // 2 + 1, : cells[1] // 2 + 1].copy()

    def stiffness(self, wave_number: FloatArray) -> FloatArray:
        """Return ``E* k / (2 M(kh))``."""
        shape = compliance_shape(wave_number * self.thickness_mm, self.poisson)
        stiffness: FloatArray = 0.5 * self.modulus_mpa * wave_number / shape
        return stiffness


def wave_numbers(cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
    """Return the (nx, ns//2+1) wave numbers [1/mm] of a real transform."""
    kx = 2 * math.pi * np.fft.fftfreq(cells[0], cell_mm[0])
    ks = 2 * math.pi * np.fft.rfftfreq(cells[1], cell_mm[1])
    k: FloatArray = np.hypot(kx[:, None], ks[None, :])
    return k


def _potential(cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
    """Return ``H`` at the near offsets and one more on either side."""
    x = (np.arange(-1, min(cells[0], _NEAR) + 1) * cell_mm[0])[:, None]
    s = (np.arange(-1, min(cells[1], _NEAR) + 1) * cell_mm[1])[None, :]
    # Where a denominator is zero its factor is, too: the product's limit is 0.
    safe_x, safe_s = np.where(x == 0, 1.0, np.abs(x)), np.where(s == 0, 1.0, np.abs(s))
    potential: FloatArray = 0.5 * x * s * (x * np.arcsinh(s / safe_x) + s * np.arcsinh(x / safe_s))
    potential -= np.hypot(x, s) ** 3 / 6
    return potential


def _second_difference(field: FloatArray) -> FloatArray:
    """Return ``f[i+1] - 2 f[i] + f[i-1]`` along the first axis."""
    difference: FloatArray = field[2:] - 2 * field[1:-1] + field[:-2]
    return difference


def _require(good: bool, name: str, value: float, expected: str) -> None:
    if not good:
        raise RigError(
            f"The elastic body's {name} is {value:g}; it must be {expected} and finite.",
            hint="Correct the parameters of the kernel.",
        )
