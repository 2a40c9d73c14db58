"""The reference rung of a bonded layer: boundary elements, with no penalty between indenter and skin."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import BondedLayer, SkinState
from tactbench.rigs.twin.boundary_elements.contact import press
from tactbench.rigs.twin.boundary_elements.kernels import Layer
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.press import Coreless, at_rest
from tactbench.rigs.twin.geometry import Contact
from tactbench.rigs.twin.shapes import BEYOND_MM


class ElementsPress(Coreless):
    """Solves every load of a layer by itself.

    Parameters
    ----------
    skin
        As declared; its `contact_stiffness` is a penalty of the default rung's and is not used here.
    medium
        The same on its grid.
    gap_mm
        (nx, ns) gap at zero approach.
    contact
        Where the apex is.
    """

    def __init__(self, skin: BondedLayer, medium: Medium, gap_mm: FloatArray, contact: Contact) -> None:
        self.medium = medium
        self.contact = contact
        self.solves = 0
        # A flank of another shape than a cap is no surface: its height would be a mean with that of its neighbours.
        self._gap = gap_mm if contact.shape is None else np.where(gap_mm < BEYOND_MM, gap_mm, np.inf)
        self._least_gap = float(gap_mm.min())
        self._layer = Layer(skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm"))

    def __call__(self, force_n: float) -> SkinState:
        """Return the skin under `force_n`; at zero force it is at rest. Raises RigError if it does not settle."""
        if force_n <= 0:
            return at_rest(self.medium)
        self.solves += 1
        found = press(self._layer, self._gap, self.medium.grid.cell_mm, force_n)
        return SkinState(
            grid=self.medium.grid,
            force_n=force_n,
            deflection_mm=found.displacement_mm,
            pressure_mpa=found.pressure_mpa,
            thickness_mm=self.medium.thickness_mm(found.displacement_mm),
            depth_mm=found.depth_mm - self._least_gap,
            fluid_pressure_mpa=0.0,
            contact_radius_mm=found.contact_radius_mm,
            residual=found.residual,
        )
