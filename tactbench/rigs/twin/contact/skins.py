"""Which module presses which declared skin."""

from __future__ import annotations

import sys

from tactbench.plugin import Quantity, RigError
from tactbench.plugin.simulation import BondedLayer, FluidBackedShell, FoamPad, SkinGrid
from tactbench.rigs.twin.contact.media import Medium

_MAY_BE_ZERO = frozenset({
    "poisson", "shear", "tension", "cover_tension", "cover_bending", "clamp_stiffness", "residual_film",
})  # fmt: skip


def medium_of(skin: FluidBackedShell | FoamPad | BondedLayer, grid: SkinGrid) -> Medium:
    """Return the medium a spec declares, on `grid`; only its own module is imported.

    Raises
    ------
    RigError
        If a parameter is not physical.
    """
    for name in type(skin).model_fields:
        stated, zero = getattr(skin, name), name in _MAY_BE_ZERO
        most = 0.5 if name == "poisson" else sys.float_info.max
        if isinstance(stated, Quantity) and not (0 < stated.value <= most or (zero and stated.value == 0)):
            raise RigError(
                f"The skin's {name} is {stated}; it must be finite, {'at least' if zero else 'above'} 0"
                f"{' and at most 0.5' if most < 1 else ''}.",
                hint="Correct the skin in the sensor's spec.",
            )
    if isinstance(skin, FluidBackedShell):
        from tactbench.rigs.twin.contact import shell

        return shell.medium(skin, grid)
    if isinstance(skin, FoamPad):
        from tactbench.rigs.twin.contact import foam

        return foam.medium(skin, grid)
    from tactbench.rigs.twin.contact import layer

    return layer.medium(skin, grid)
