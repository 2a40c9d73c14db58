"""Contact of a rigid indenter with an elastic half-space, without friction or adhesion.

All hold for small strains: contact radii far below the indenter's radius (the sag of a sphere exceeds that of its
paraboloid by ``(a/2R)²``: 1 % at a = 0.2 R) and far below the body's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray


@dataclass(frozen=True)
class Hertz:
    """A paraboloid ``r²/2R`` on a half-space (Hertz 1882; Johnson 1985, section 4.2)."""

    radius_mm: float
    modulus_mpa: float
    """Plane strain modulus ``E* = E / (1 - nu²)``."""

    def force_n(self, depth_mm: float) -> float:
        """Return ``4/3 E* sqrt(R) d^(3/2)``."""
        return 4 / 3 * self.modulus_mpa * math.sqrt(self.radius_mm * depth_mm) * depth_mm

    def depth_mm(self, force_n: float) -> float:
        """Return ``a²/R``."""
        return self.contact_radius_mm(force_n) ** 2 / self.radius_mm

    def contact_radius_mm(self, force_n: float) -> float:
        """Return ``(3 F R / 4 E*)^(1/3)``."""
        return float(math.cbrt(3 * force_n * self.radius_mm / (4 * self.modulus_mpa)))

    def largest_pressure_mpa(self, force_n: float) -> float:
        """Return ``p0 = 3 F / (2 pi a²)``."""
        return 1.5 * force_n / (math.pi * self.contact_radius_mm(force_n) ** 2)

    def pressure_mpa(self, force_n: float, r_mm: FloatArray) -> FloatArray:
        """Return ``p0 sqrt(1 - r²/a²)`` at distances from the axis, 0 outside."""
        inside = np.clip(1 - (r_mm / self.contact_radius_mm(force_n)) ** 2, 0.0, None)
        pressure: FloatArray = self.largest_pressure_mpa(force_n) * np.sqrt(inside)
        return pressure

    def radial_mm(self, force_n: float, r_mm: FloatArray, poisson: float) -> FloatArray:
        """Return how far the surface moves from the axis (below 0: towards it) at distances above 0 (Johnson 3.41b)."""
        inside = 1 - np.clip(1 - (r_mm / self.contact_radius_mm(force_n)) ** 2, 0.0, None) ** 1.5
        scale = -(1 - 2 * poisson) / (2 * math.pi * (1 - poisson) * self.modulus_mpa) * force_n
        moved: FloatArray = scale * inside / r_mm
        return moved


@dataclass(frozen=True)
class FlatPunch:
    """A rigid cylinder of flat end on a half-space (Boussinesq 1885; Johnson 1985, section 3.8)."""

    punch_radius_mm: float
    modulus_mpa: float

    def force_n(self, depth_mm: float) -> float:
        """Return ``2 a E* d``."""
        return 2 * self.punch_radius_mm * self.modulus_mpa * depth_mm

    def depth_mm(self, force_n: float) -> float:
        """Return ``F / (2 a E*)``."""
        return force_n / (2 * self.punch_radius_mm * self.modulus_mpa)

    def pressure_mpa(self, force_n: float, r_mm: FloatArray) -> FloatArray:
        """Return ``F / (2 pi a sqrt(a² - r²))`` at distances from the axis; infinite at the edge, 0 outside."""
        a = self.punch_radius_mm
        with np.errstate(divide="ignore"):
            inside = force_n / (2 * math.pi * a * np.sqrt(np.clip(a**2 - r_mm**2, 0.0, None)))
        pressure: FloatArray = np.where(r_mm <= a, inside, 0.0)
        return pressure


def point_load_mm(force_n: float, r_mm: FloatArray, modulus_mpa: float) -> FloatArray:
    """Return the surface's sinking at distances r > 0 from a point load, ``F / (pi E* r)``.

    Boussinesq 1885; Johnson 1985, eq. 3.22. For a load spread over a patch of size b it holds at r >> b.
    """
    sinking: FloatArray = force_n / (math.pi * modulus_mpa * np.asarray(r_mm, dtype=np.float64))
    return sinking
