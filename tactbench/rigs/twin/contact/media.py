"""The interface of skin media to the solver: a stiffness per Fourier mode and a local law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import SkinGrid
from tactbench.rigs.twin.contact.spectrum import Spectrum


class LocalLaw(Protocol):
    """A force law of each cell by itself."""

    def __call__(self, deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
        """Return the (nx, ns) restoring pressure [MPa] (a new array) and the summed energy density [N/mm].

        Fills `tangent` with the (nx, ns) derivative of the pressure [MPa/mm].
        """


@dataclass(frozen=True)
class Medium:
    """A skin on a grid. Units mm, N, MPa."""

    grid: SkinGrid
    spectrum: Spectrum
    stiffness: FloatArray
    """(nx, ns//2+1) pressure per deflection of each mode [MPa/mm]."""
    respond: LocalLaw
    contact_stiffness: float
    """Stiffness of the contact between indenter and skin [MPa/mm]."""
    zero_mean: bool
    """The volume under the skin is constant: the mean deflection is zero."""
    rest_thickness_mm: FloatArray
    """(nx, ns) thickness of film or layer without contact."""
    least_thickness_mm: float
    """Film that remains when the skin is pressed flat; 0 where there is no such limit."""
    low_modes: int
    """Pairs of soft modes that the preconditioner solves exactly: chosen for speed, without effect on the result."""
    contact_updates: int = 0
    """Number of corrections for the penetration by the penalty; 0 where the contact stiffness is a skin property."""
    has_core: bool = False
    """A core carries load when less than `least_thickness_mm` would be left."""

    def closing_mm(self, deflection_mm: FloatArray) -> float:
        """Return how far the skin passes the least film; above zero the core is touched."""
        return float(np.max(deflection_mm - self.rest_thickness_mm)) + self.least_thickness_mm

    def thickness_mm(self, deflection_mm: FloatArray) -> FloatArray:
        """Return the (nx, ns) film or layer left."""
        left = self.rest_thickness_mm - deflection_mm
        return np.maximum(left, self.least_thickness_mm) if self.has_core else left
