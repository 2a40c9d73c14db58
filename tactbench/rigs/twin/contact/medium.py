"""What all media look like to the solver: a linear part that is diagonal in Fourier space, and a local convex law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from tactbench.plugin import FloatArray, SkinGrid


class LocalLaw(Protocol):
    """A convex energy of the deflection at each point."""

    def energy(self, w: FloatArray) -> FloatArray:
        """Return the energy density [N/mm] at deflection `w` [mm]."""

    def pressure(self, w: FloatArray) -> FloatArray:
        """Return its derivative [MPa]."""

    def tangent(self, w: FloatArray) -> FloatArray:
        """Return its second derivative [MPa/mm], never negative."""


@dataclass(frozen=True)
class Medium:
    """A skin on a grid."""

    grid: SkinGrid
    stiffness: FloatArray
    """(nx, ns/2+1) K of each wave number [MPa/mm]"""
    law: LocalLaw
    contact_stiffness: float
    """penalty under the indenter [MPa/mm]"""
    keeps_volume: bool
    """the mean of the deflection stays zero: an incompressible fluid is enclosed"""
    outer_radius_mm: float
    rest_thickness_mm: FloatArray
    """(nx, ns) film or foam at rest"""
    least_thickness_mm: float
    """what stays open when all is closed"""
    core_at_mm: FloatArray | None = None
    """(nx, ns) deflection at which the skin meets the core; None where there is none to meet"""
