"""Contacts that have been solved on paper (Johnson 1985): a rigid indenter, small strains. In mm, N and MPa."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Hertz:
    """A paraboloid ``r²/2R`` on a half-space (section 4.2)."""

    radius_mm: float
    modulus_mpa: float
    """Plane strain modulus ``E* = E / (1 - nu²)``."""

    def depth_mm(self, force_n: float) -> float:
        return self.contact_radius_mm(force_n) ** 2 / self.radius_mm

    def contact_radius_mm(self, force_n: float) -> float:
        return math.cbrt(3 * force_n * self.radius_mm / (4 * self.modulus_mpa))

    def largest_pressure_mpa(self, force_n: float) -> float:
        return 1.5 * force_n / (math.pi * self.contact_radius_mm(force_n) ** 2)

    def pressure_mpa(self, force_n: float, r_mm: np.ndarray) -> np.ndarray:
        inside = np.clip(1 - (r_mm / self.contact_radius_mm(force_n)) ** 2, 0.0, None)
        return self.largest_pressure_mpa(force_n) * np.sqrt(inside)

    def radial_mm(self, force_n: float, r_mm: np.ndarray, poisson: float) -> np.ndarray:
        """Return how far the surface moves from the axis (below 0: towards it) at distances above 0 (3.41b)."""
        inside = 1 - np.clip(1 - (r_mm / self.contact_radius_mm(force_n)) ** 2, 0.0, None) ** 1.5
        return -(1 - 2 * poisson) / (2 * math.pi * (1 - poisson) * self.modulus_mpa) * force_n * inside / r_mm


@dataclass(frozen=True)
class CattaneoMindlin:
    """A pressed sphere that is then pushed sideways below slip (section 7.2): inside a circle it sticks.

    Exact if normal and tangential answers do not mix: equal bodies, or a rigid one on an incompressible one.
    """

    friction: float
    contact_radius_mm: float
    normal_n: float
    tangential_modulus_mpa: float
    """``G* = 4 G / (2 - nu)`` against a rigid body."""

    def stick_radius_mm(self, push_n: float) -> float:
        return self.contact_radius_mm * math.cbrt(max(1 - push_n / (self.friction * self.normal_n), 0.0))

    def shift_mm(self, push_n: float) -> float:
        left = max(1 - push_n / (self.friction * self.normal_n), 0.0)
        compliance = 1 / (2 * self.contact_radius_mm * self.tangential_modulus_mpa)
        return 1.5 * self.friction * self.normal_n * compliance * (1 - left ** (2 / 3))

    def traction_mpa(self, push_n: float, r_mm: np.ndarray) -> np.ndarray:
        a, c = self.contact_radius_mm, self.stick_radius_mm(push_n)
        whole = np.sqrt(np.clip(1 - (r_mm / a) ** 2, 0.0, None))
        inner = c / a * np.sqrt(np.clip(1 - (r_mm / c) ** 2, 0.0, None))
        return self.friction * 1.5 * self.normal_n / (math.pi * a**2) * (whole - inner)
