"""Contacts that have been solved on paper (Johnson 1985): a rigid indenter, small strains. In mm, N and MPa."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


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
