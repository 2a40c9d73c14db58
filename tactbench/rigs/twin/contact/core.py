"""Model of the rigid core under a fluid-backed skin, which carries load where the fluid film is closed.

The core is added only when a load closes the film. Below that load the solutions with and without the core are the
same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import FluidBackedShell
from tactbench.rigs.twin.contact.media import LocalLaw, Medium


class CoreReaction:
    """Another local law plus a one-sided spring, which pushes only where the film is closed."""

    def __init__(self, below: LocalLaw, stiffness: float, film_mm: FloatArray) -> None:
        self._below = below
        self._stiffness = stiffness
        self._film_mm = film_mm

    def __call__(self, deflection_mm: FloatArray, tangent: FloatArray) -> tuple[FloatArray, float]:
        """Return the (nx, ns) restoring pressure [MPa] and the summed energy density [N/mm]; fill `tangent`."""
        pressure, energy = self._below(deflection_mm, tangent)
        pressed = deflection_mm - self._film_mm
        np.maximum(pressed, 0.0, out=pressed)
        tangent += self._stiffness * (pressed > 0)
        flat = pressed.reshape(-1)
        energy += 0.5 * self._stiffness * float(flat @ flat)
        pressed *= self._stiffness
        pressure += pressed
        return pressure, energy


def with_core(medium: Medium, skin: FluidBackedShell) -> Medium:
    """Return `medium` with a core that carries load where less than the residual film is left."""
    film = medium.rest_thickness_mm - medium.least_thickness_mm
    return replace(medium, respond=CoreReaction(medium.respond, skin.core_stiffness.to("MPa/mm"), film))
