"""The interface of skin media to the solver: a stiffness per Fourier mode and a local law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import SkinGrid
from tactbench.rigs.twin.contact.spectrum import Spectrum


class LocalLaw(Protocol):
    """A function from a cell's deflection to its restoring pressure, independent of other cells."""

    def __call__(self, deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
        """Return the (nx, ns) restoring pressure [MPa] (a new array) and the summed energy density [N/mm].

        Fills `tangent` with the (nx, ns) derivative of the pressure [MPa/mm].
        """


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
