"""A pressed sphere that is then pushed sideways: part of the contact sticks, a ring around it slips."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray


@dataclass(frozen=True)
class CattaneoMindlin:
    """Cattaneo 1938, Mindlin 1949; Johnson 1985, section 7.2. Normal force first, then a tangential one below slip.

    Exact if normal and tangential answers do not mix: equal bodies, or a rigid one on an incompressible one; else
    good to a few per cent. Traction is taken parallel to the push everywhere.
    """

    friction: float
    contact_radius_mm: float
    normal_n: float
    tangential_modulus_mpa: float
    """``1/G* = (2 - nu) / 4G`` summed over both bodies: ``G* = 4 G / (2 - nu)`` against a rigid one."""

    def stick_radius_mm(self, push_n: float) -> float:
        """Return ``c = a (1 - Q / mu P)^(1/3)``; 0 once everything slips."""
        share = math.cbrt(max(1 - push_n / (self.friction * self.normal_n), 0.0))
        return self.contact_radius_mm * min(share, 1.0)  # the root of a number just below 1 may be rounded above it

    def shift_mm(self, push_n: float) -> float:
        """Return the tangential approach ``3 mu P / (4 a G*) [1 - (1 - Q/mu P)^(2/3)]``."""
        left = max(1 - push_n / (self.friction * self.normal_n), 0.0)
        return 1.5 * self.friction * self.normal_n * self.compliance_mm_per_n * float(1 - left ** (2 / 3))

    @property
    def compliance_mm_per_n(self) -> float:
        """Slope of the shift at no push, ``(2 - nu) / (8 a G) = 1 / (2 a G*)``."""
        return 1 / (2 * self.contact_radius_mm * self.tangential_modulus_mpa)

    def traction_mpa(self, push_n: float, r_mm: FloatArray) -> FloatArray:
        """Return the shear traction at distances from the axis: Hertz's times mu, less its like inside the stick."""
        a, c = self.contact_radius_mm, self.stick_radius_mm(push_n)
        p0 = 1.5 * self.normal_n / (math.pi * a**2)
        r2 = np.asarray(r_mm, dtype=np.float64) ** 2
        whole = np.sqrt(np.clip(1 - r2 / a**2, 0.0, None))
        inner = (c / a) * np.sqrt(np.clip(1 - r2 / c**2, 0.0, None)) if c > 0 else np.zeros_like(r2)
        traction: FloatArray = self.friction * p0 * (whole - inner)
        return traction
