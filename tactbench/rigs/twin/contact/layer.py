"""A linear elastic layer bonded to a rigid base, frictionless on top."""

from __future__ import annotations

import numpy as np

from tactbench.plugin.simulation import BondedLayer, SkinGrid
from tactbench.rigs.twin.contact.media import Medium, no_local_law
from tactbench.rigs.twin.contact.spectrum import Spectrum
from tactbench.rigs.twin.layer_kernel import compliance_shape


def medium(skin: BondedLayer, grid: SkinGrid) -> Medium:
    """Return the layer on `grid`: ``K = E* k / (2 M(k h))``, and ``E_oed / h`` for a uniform pressure.

    An incompressible layer does not yield to a uniform pressure: its mean deflection is held at zero.
    """
    young, poisson, thickness = skin.young.to("MPa"), skin.poisson.to("1"), skin.thickness.to("mm")
    spectrum = Spectrum(grid)
    k = np.sqrt(spectrum.k2)
    k[0, 0] = 1.0
    stiffness = young / (1 - poisson**2) * k / (2 * compliance_shape(k * thickness, poisson))
    incompressible = poisson == 0.5
    oedometric = 0.0 if incompressible else young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    stiffness[0, 0] = oedometric / thickness
    return Medium(
        grid=grid,
        spectrum=spectrum,
        stiffness=stiffness,
        respond=no_local_law,
        contact_stiffness=skin.contact_stiffness.to("MPa/mm"),
        zero_mean=incompressible,
        rest_thickness_mm=np.full(spectrum.shape, thickness),
        least_thickness_mm=0.0,
        low_modes=80,
    )
