"""Partial slip under a tangential force: the closed forms of Cattaneo (1938) and Mindlin (1949).

A contact pressed by P and pushed along by Q < mu P sticks inside the radius c and slips in the annulus outside it.
Formulas as in Johnson, Contact Mechanics (1985), section 7.2, for a rigid body on a half-space:
``1/G* = (2 - nu)/G``. A skin is a layer: on a rigid base it is stiffer than the half-space once the contact is wider
than the layer is thick, over a fluid it can also stretch as a sheet and is softer (see ``docs/effects.md``).
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import FoamPad, Skin


def shear_modulus_mpa(skin: Skin) -> float:
    """Return the skin's effective shear modulus ``G* = G/(2 - nu)`` [MPa].

    A foam has its own G and nu = 0 (its lateral contraction is neglected in ``contact`` too).
    """
    if isinstance(skin, FoamPad):
        return skin.shear.to("MPa") / 2.0
    poisson = skin.poisson.to("1")
    return skin.young.to("MPa") / (2.0 * (1.0 + poisson)) / (2.0 - poisson)


def sliding_stiffness(contact_radius_mm: FloatArray, shear_mpa: float) -> FloatArray:
    """Return ``16 a G*/3`` [N/mm]: tangential force over displacement of a contact in full slip (Johnson 7.42).

    The formula holds for any force if tractions are proportional to the pressure, as in full slip; a contact that
    sticks everywhere is stiffer by half, ``8 a G*`` (Johnson 7.44).
    """
    return 16.0 / 3.0 * contact_radius_mm * shear_mpa


def share_of_force(travelled: FloatArray) -> FloatArray:
    """Return the share of the force needed for full slip, from the share s of the displacement: ``1 - (1 - s)^(3/2)``.

    This is Johnson 7.42 solved for the force. Both shares count from the last state with tractions proportional to the
    pressure, at rest or at the end of a slip: Cattaneo's argument holds from either.
    """
    return 1.0 - (1.0 - np.clip(travelled, 0.0, 1.0)) ** 1.5


def stick_ratio(travelled: FloatArray) -> FloatArray:
    """Return c/a from the share s of full slip's displacement: ``(1 - Q/mu P)^(1/3) = sqrt(1 - s)`` (Johnson 7.39)."""
    return np.sqrt(1.0 - np.clip(travelled, 0.0, 1.0))
