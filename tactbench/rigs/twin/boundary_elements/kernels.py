"""What is pressed: how far a surface sinks under pressure elsewhere. Millimetres, newtons, megapascals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.layer_kernel import compliance_shape


class Kernel(Protocol):
    """A linear elastic surface without friction. Implementations are frozen, so that transforms can be kept."""

    @property
    def periodic(self) -> bool:
        """Whether the domain repeats itself; else pressure outside the domain is zero."""

    def influence(self, cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
        """Return the displacement [mm/MPa] that unit pressure on one cell causes (i, j) cells away, i, j >= 0.

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
        """Return the (nx, ns) displacement by a uniformly pressed rectangle (Love 1929; Johnson 1985, eq. 3.25).

        ``[f(X+a, Y+b) - f(X-a, Y+b) - f(X+a, Y-b) + f(X-a, Y-b)] / (pi E*)`` at its surroundings (X, Y), with half
        sides a, b and ``f = X asinh(Y/|X|) + Y asinh(X/|Y|)``. No argument is zero: corners lie between centres.
        """
        x = ((np.arange(cells[0] + 1) - 0.5) * cell_mm[0])[:, None]
        s = ((np.arange(cells[1] + 1) - 0.5) * cell_mm[1])[None, :]
        corner = x * np.arcsinh(s / np.abs(x)) + s * np.arcsinh(x / np.abs(s))
        spread: FloatArray = corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1]
        return spread / (math.pi * self.modulus_mpa)

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
        """Return the (nx//2+1, ns//2+1) periodic influence: the transform of the compliance ``2 M(kh) / (E* k)``."""
        from scipy import fft

        compliance = np.empty((cells[0], cells[1] // 2 + 1))
        k = wave_numbers(cells, cell_mm)
        k[0, 0] = 1.0
        compliance[:] = 1.0 / self.stiffness(k)
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


def _require(good: bool, name: str, value: float, expected: str) -> None:
    if not good:
        raise RigError(
            f"The elastic body's {name} is {value:g}; it must be {expected} and finite.",
            hint="Correct the parameters of the kernel.",
        )
