"""From a declared skin to a medium on a grid."""

from __future__ import annotations

from tactbench.plugin import FluidBackedShell, FoamPad, RigError, SensorSpec, SkinGrid
from tactbench.rigs.twin.contact.foam import foam
from tactbench.rigs.twin.contact.layer import layer
from tactbench.rigs.twin.contact.medium import Medium
from tactbench.rigs.twin.contact.shell import shell
from tactbench.rigs.twin.geometry import grid_of


def medium_of(sensor: SensorSpec, cells: tuple[int, int] | None = None) -> Medium:
    """Return the skin of `sensor` on its grid, or on another of `cells`; raises RigError if it declares none."""
    if sensor.skin is None:
        raise RigError(
            f"The sensor {sensor.name!r} declares no skin, so it cannot be pressed in simulation.",
            hint="Declare one of the media of tactbench.plugin, or use --rig replay.",
        )
    grid: SkinGrid = grid_of(sensor.skin.sheet, cells)
    if isinstance(sensor.skin, FluidBackedShell):
        return shell(sensor.skin, grid)
    if isinstance(sensor.skin, FoamPad):
        return foam(sensor.skin, grid)
    return layer(sensor.skin, grid)
