"""Which module presses which declared skin."""

from __future__ import annotations

import math

from tactbench.plugin import Quantity, RigError
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, FoamPad, SkinGrid
from tactbench.rigs.twin.contact.media import Medium


def medium_of(skin: FluidBackedShell | FoamPad | BondedLayer, grid: SkinGrid) -> Medium:
    """Return the medium a spec declares, on `grid`; only its own module is imported.

    Raises
    ------
    RigError
        If the parameters are not physical, or the medium is none the twin can press.
    """
    for name in type(skin).model_fields:
        stated = getattr(skin, name)
        if isinstance(stated, Quantity) and not 0 <= stated.value < math.inf:
            raise RigError(
                f"The skin's {name} is {stated}; it must be finite and not below zero.",
                hint="Correct the skin in the sensor's spec.",
            )
    if isinstance(skin, FluidBackedShell):
        from tactbench.rigs.twin.contact import shell

        return shell.medium(skin, grid)
    if isinstance(skin, FoamPad):
        from tactbench.rigs.twin.contact import foam

        return foam.medium(skin, grid)
    if isinstance(skin, BondedLayer):
        from tactbench.rigs.twin.contact import layer

        return layer.medium(skin, grid)
    raise RigError(
        f"The twin cannot press a skin of type {type(skin).__name__}.",
        hint="Declare one of FluidBackedShell, FoamPad and BondedLayer.",
    )
