"""A paraboloid sticking to a half-space by short-range adhesion."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Jkr:
    """Johnson, Kendall & Roberts 1971 (Proc. R. Soc. A 324); Johnson 1985, section 5.5.

    Holds for soft, large, sticky bodies: a Tabor parameter ``(R w² / (E*² z0³))^(1/3)`` above about 5, with z0 the
    range of the adhesion (Tabor 1977).
    """

    radius_mm: float
    modulus_mpa: float
    """Plane strain modulus ``E* = E / (1 - nu²)``."""
    work_n_per_mm: float
    """Work of adhesion per area; 0 is Hertz."""

    def force_n(self, contact_radius_mm: float) -> float:
        """Return ``4 E* a³ / 3R - sqrt(8 pi w E* a³)``; negative pulls."""
        cube = contact_radius_mm**3
        return 4 * self.modulus_mpa * cube / (3 * self.radius_mm) - math.sqrt(
            8 * math.pi * self.work_n_per_mm * self.modulus_mpa * cube
        )

    def depth_mm(self, contact_radius_mm: float) -> float:
        """Return ``a²/R - sqrt(2 pi w a / E*)``."""
        return contact_radius_mm**2 / self.radius_mm - math.sqrt(
            2 * math.pi * self.work_n_per_mm * contact_radius_mm / self.modulus_mpa
        )

    def contact_radius_mm(self, force_n: float) -> float:
        """Return the stable contact radius under a force >= the pull-off force.

        ``a³ = 3R/4E* [F + 3 pi w R + sqrt(6 pi w R F + (3 pi w R)²)]``.
        """
        stuck = 3 * math.pi * self.work_n_per_mm * self.radius_mm
        root = math.sqrt(max(2 * stuck * force_n + stuck**2, 0.0))
        return float(math.cbrt(3 * self.radius_mm / (4 * self.modulus_mpa) * (force_n + stuck + root)))

    @property
    def pull_off_n(self) -> float:
        """The smallest force that holds, ``-3/2 pi w R``."""
        return -1.5 * math.pi * self.work_n_per_mm * self.radius_mm

    @property
    def pull_off_radius_mm(self) -> float:
        """Contact radius at pull-off, ``(9 pi w R² / 8 E*)^(1/3)``."""
        return float(math.cbrt(9 * math.pi * self.work_n_per_mm * self.radius_mm**2 / (8 * self.modulus_mpa)))
