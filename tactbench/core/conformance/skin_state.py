"""A sensor's skin as a transducer sees it: its grid, places on its sheet, and states that a local press would leave."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tactbench.core.samples import SkinGrid, SkinState
from tactbench.core.spec.sensor import Vector
from tactbench.core.spec.skin import FluidBackedShell, Skin, SkinSheet

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray

PATCH_MM, PATCH_CELLS = 1.25, 1.5
"""Standard deviation of a local press: half the radius of a fingertip's contact, and no less than the grid resolves
[cells]."""


def on_sheet_mm(sheet: SkinSheet, position_m: Vector) -> tuple[float, float]:
    """Return the axial coordinate and the arc length at which a place of the sensor's frame lies on the sheet [mm]."""
    x_mm, y_mm, z_mm = (1e3 * part for part in position_m)
    if sheet.outer_radius is None:
        return x_mm, y_mm
    return x_mm, sheet.outer_radius.to("mm") * math.atan2(y_mm, -z_mm)


def skin_grid(sheet: SkinSheet) -> SkinGrid:
    """Return the centres of the sheet's own cells."""
    import numpy as np

    along, across = sheet.cells
    low, high, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    x_mm: FloatArray = low + (np.arange(along) + 0.5) * (high - low) / along
    s_mm: FloatArray = -arc / 2 + (np.arange(across) + 0.5) * arc / across
    return SkinGrid(x_mm=x_mm, s_mm=s_mm)


def patch_mm(grid: SkinGrid) -> float:
    """Return the standard deviation of a local press."""
    return max(PATCH_CELLS * max(grid.cell_mm), PATCH_MM)


def pressed_locally(
    skin: Skin, grid: SkinGrid, force_n: float, at_mm: tuple[float, float], dragged: tuple[float, float] | None
) -> SkinState:
    """Return the state that a narrow press would leave: a bell of pressure, and a dent of the same shape.

    No equation is solved: it is a state that a transducer must be able to read, and that touches one place only. The
    dent goes a third of the way through the skin at 1 N and further in proportion, never through more than nine tenths.
    `dragged` is the tangential force over the normal one, along x and s, for a sensor that reads shear: it moves the
    dent by a third of that share of its depth, and the press alone moves the skin away from its middle by as much;
    None: nobody looks along the skin.
    """
    import numpy as np

    sigma = patch_mm(grid)
    x_mm, s_mm = np.meshgrid(grid.x_mm - at_mm[0], grid.s_mm - at_mm[1], indexing="ij")
    bell = np.exp(-(x_mm**2 + s_mm**2) / (2 * sigma**2))
    pressure = force_n / (2 * math.pi * sigma**2) * bell
    fluid = isinstance(skin, FluidBackedShell)
    if isinstance(skin, FluidBackedShell):
        radius_mm = math.inf if skin.sheet.outer_radius is None else skin.sheet.outer_radius.to("mm")
        rest: FloatArray = skin.film.at(grid.x_mm, grid.s_mm / radius_mm)
        least = skin.residual_film.to("mm")
    else:
        rest, least = np.full(bell.shape, skin.thickness.to("mm")), 0.0
    deflection = min(force_n / 3, 0.9) * bell * rest
    moved, shear = None, None
    if dragged is not None:
        way = np.array(dragged)[:, None, None]
        moved = (np.stack([x_mm, s_mm]) / sigma + way) * deflection / 3
        shear = way * pressure
    return SkinState(
        grid=grid, force_n=force_n, deflection_mm=deflection, pressure_mpa=pressure,
        thickness_mm=np.maximum(rest - deflection, least), depth_mm=float(deflection.max()),
        fluid_pressure_mpa=0.001 * force_n * fluid,
        contact_radius_mm=math.sqrt(5.0) * sigma if force_n else 0.0, residual=0.0,
        tangential_displacement_mm=moved, shear_mpa=shear,
    )  # fmt: skip
