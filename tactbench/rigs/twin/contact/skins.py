"""From a declared skin to a medium on a grid."""

from __future__ import annotations

from tactbench.plugin import FluidBackedShell, FoamPad, Skin
from tactbench.rigs.twin.contact.foam import foam
from tactbench.rigs.twin.contact.layer import layer
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.contact.shell import shell
from tactbench.rigs.twin.geometry import grid_of


def medium_of(skin: Skin, cells: tuple[int, int] | None = None) -> Medium:
    """Return `skin` on its own grid, or on one of `cells` (axial x arc)."""
    grid = grid_of(skin.sheet, cells)
    if isinstance(skin, FluidBackedShell):
        return shell(skin, grid)
    if isinstance(skin, FoamPad):
        return foam(skin, grid)
    return layer(skin, grid)
