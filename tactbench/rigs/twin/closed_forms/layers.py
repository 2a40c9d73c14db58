"""A paraboloid ``r²/2R`` on a thin layer bonded to a rigid base, without friction: contact radius far above thickness.

Johnson 1985, section 5.8, gives both limits. They are the leading terms in thickness over contact radius: at a ratio
of ten, the incompressible depth is still some per cent above the truth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, RigError


def oedometric_mpa(young_mpa: float, poisson: float) -> float:
    """Return the modulus of a layer that cannot spread, ``E (1-nu) / ((1+nu) (1-2nu))``.

    Raises
    ------
    RigError
        At nu >= 1/2, where it is infinite.
    """
    if not -1 < poisson < 0.5:
        raise RigError(
            f"A layer of Poisson's ratio {poisson:g} has no oedometric modulus; it needs a ratio below 0.5.",
            hint="Use the incompressible layer.",
        )
    return young_mpa * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))


@dataclass(frozen=True)
class Winkler:
    """A paraboloid on springs that do not know each other: ``p = k u``. Also the thin compressible layer's limit.

    Of a layer, ``k = oedometric modulus / thickness``. Good for foams (nu <= 0.3, contact wider than the layer is
    thick), wrong by factors for rubbers.
    """

    radius_mm: float
    stiffness_mpa_per_mm: float

    @classmethod
    def of_layer(cls, radius_mm: float, young_mpa: float, poisson: float, thickness_mm: float) -> Winkler:
        """Return the springs that a thin compressible layer is."""
        return cls(radius_mm, oedometric_mpa(young_mpa, poisson) / thickness_mm)

    def force_n(self, depth_mm: float) -> float:
        """Return ``pi k R d²``."""
        return math.pi * self.stiffness_mpa_per_mm * self.radius_mm * depth_mm**2

    def depth_mm(self, force_n: float) -> float:
        """Return ``sqrt(F / (pi k R))``."""
        return math.sqrt(force_n / (math.pi * self.stiffness_mpa_per_mm * self.radius_mm))

    def contact_radius_mm(self, force_n: float) -> float:
        """Return ``sqrt(2 R d)``."""
        return math.sqrt(2 * self.radius_mm * self.depth_mm(force_n))

    def pressure_mpa(self, force_n: float, r_mm: FloatArray) -> FloatArray:
        """Return ``k (d - r²/2R)`` at distances from the axis, 0 outside."""
        u = np.clip(self.depth_mm(force_n) - np.asarray(r_mm) ** 2 / (2 * self.radius_mm), 0.0, None)
        pressure: FloatArray = self.stiffness_mpa_per_mm * u
        return pressure


@dataclass(frozen=True)
class IncompressibleLayer:
    """A paraboloid on a thin incompressible layer, which can only flow aside.

    Its sinking is ``-(h³/3G) times the Laplacian of p``; with pressure and its slope zero at the rim,
    ``p = p0 (1 - r²/a²)²`` and ``a² = 4 R d``: the surface rises to the indenter at the rim.
    """

    radius_mm: float
    young_mpa: float
    thickness_mm: float

    def force_n(self, depth_mm: float) -> float:
        """Return ``2 pi G R² d³ / h³`` with ``G = E/3``."""
        return 2 / 3 * math.pi * self.young_mpa * self.radius_mm**2 * (depth_mm / self.thickness_mm) ** 3

    def depth_mm(self, force_n: float) -> float:
        """Return ``h (3 F / (2 pi E R²))^(1/3)``."""
        return self.thickness_mm * float(math.cbrt(1.5 * force_n / (math.pi * self.young_mpa * self.radius_mm**2)))

    def contact_radius_mm(self, force_n: float) -> float:
        """Return ``2 sqrt(R d)``."""
        return 2 * math.sqrt(self.radius_mm * self.depth_mm(force_n))

    def pressure_mpa(self, force_n: float, r_mm: FloatArray) -> FloatArray:
        """Return ``3F / (pi a²) (1 - r²/a²)²`` at distances from the axis, 0 outside."""
        a2 = self.contact_radius_mm(force_n) ** 2
        inside = np.clip(1 - np.asarray(r_mm) ** 2 / a2, 0.0, None)
        pressure: FloatArray = 3 * force_n / (math.pi * a2) * inside**2
        return pressure
