"""Limits of the contact model: checks that raise an error for a solved contact, and remarks for its recording."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError, Scalar
from tactbench.plugin.simulation import SkinGrid, SkinSheet
from tactbench.rigs.twin.contact.press import AnyPress
from tactbench.rigs.twin.geometry import RIM, STEEPEST, around_mm

RESOLVED_CELLS = 3.0
"""Smallest contact radius, in cells, at which the mesh does not affect the result. Measured on the ideal grid with a
cap of 2 mm at eight places: against cells a quarter as wide, the depth is off by up to 23 % at 0.9 cells, 6 % at
1.7, 2 % at 2.7 and 1.4 % at 3.4."""
HELD_AGAINST_N = 5.0
"""Largest load [N] in Karl et al. 2016 and in the reference values for the solver; larger ones get a remark."""
INTO_THE_CORE = 0.1
"""Share of the film's thickness by which the skin may sink into the core, whose penalty spring is soft. Assumed."""
AT_THE_EDGE = 0.01
"""Share of the load outside the active skin above which the recording gets a remark. Assumed."""


def check_reach(press: AnyPress, force_n: float, sheet: SkinSheet) -> None:
    """Raise an error for a load under which the skin touches the indenter beyond the rim of the cap.

    Raises
    ------
    RigError
        If cells beyond the cap's rim carry load: the cap would have to be pressed in past its own flanks.
    """
    if not force_n > 0 or math.isinf(press.contact.radius_mm):
        return
    along, across, _ = around_mm(press.medium.grid, press.contact, sheet)
    if np.any(press(force_n).pressure_mpa[np.hypot(along, across) >= RIM * press.contact.radius_mm] > 0):
        raise RigError(
            f"Under {force_n:g} N the cap of radius {press.contact.radius_mm:g} mm sinks into the skin beyond its rim, "
            "where the cap ends.",
            hint="Press with less force, or with a larger cap.",
        )


def remarks(press: AnyPress, force: float, sheet: SkinSheet) -> dict[str, Scalar]:
    """Return remarks on the validity of a contact on `sheet` under `force` newtons.

    Returns
    -------
    dict
        ``contact_radius_cells``: radius of the contact in cells, from its area, or half its width where the indenter
        is neither a cap nor flat; and one sentence under each ``remark …`` that applies.
    """
    if not force > 0:
        return {}
    pressure = press(force).pressure_mpa
    shape = press.contact.shape
    cells = math.sqrt(np.count_nonzero(pressure) / math.pi) if shape is None else _narrow_cells(pressure)
    found: dict[str, Scalar] = {"contact_radius_cells": cells}
    if cells < RESOLVED_CELLS:
        found["remark contact"] = (
            f"the contact is {cells:.1f} cells in radius at {force:g} N; below {RESOLVED_CELLS:g} it follows the mesh"
        )
    if force > HELD_AGAINST_N:
        found["remark load"] = f"{force:g} N is beyond {HELD_AGAINST_N:g} N, up to which the model was compared"
    medium = press.medium
    beyond = float((press(force).deflection_mm - medium.rest_thickness_mm).max())
    if medium.has_core and beyond > INTO_THE_CORE * float(medium.rest_thickness_mm.max()):
        found["remark core"] = f"the skin stands {beyond:.2f} mm inside the core, whose penalty is softer than a core"
    if not medium.has_core and beyond > 0:
        found["remark depth"] = f"the skin is pressed {beyond:.2f} mm deeper than it is thick"
    along, across, _ = np.broadcast_arrays(*around_mm(press.medium.grid, press.contact, sheet))
    along, across = along[pressure > 0], across[pressure > 0]
    radius, reach = press.contact.radius_mm, float(np.hypot(along, across).max())
    if shape is not None:
        steepest = float(shape.slope(along, across).max())
        if steepest > STEEPEST * (1 + 1e-6):  # a flank of 45 degrees, by differences
            found["remark flank"] = f"the {shape.name} touches where its flank has a slope of {steepest:.2g}"
    elif reach >= radius * math.sin(math.atan(STEEPEST)):
        found["remark flank"] = (
            f"the contact reaches {reach:.2g} mm from the axis of a cap of radius {radius:g} mm, where its flank is "
            "steeper than 45 degrees"
        )
    if sheet.dome is not None and press.contact.x_mm > sheet.dome.start.to("mm"):
        found["remark dome"] = "the contact is on the dome, where the model was never compared with real presses"
    share = float(pressure[~_active(sheet, press.medium.grid)].sum() / pressure.sum())
    if (math.isfinite(radius) or shape is not None) and share > AT_THE_EDGE:
        found["remark edge"] = f"{100 * share:.0f} % of the load stands on the margin, outside the active skin"
    return found


def _narrow_cells(pressure: FloatArray) -> float:
    """Return, in cells, the shorter half-axis of an ellipse with the second moments of the touched area."""
    places = np.argwhere(pressure > 0)
    scatter = np.atleast_2d(np.cov(places.T, bias=True)) + np.eye(2) / 12  # a cell is a square
    return 2.0 * math.sqrt(float(np.linalg.eigvalsh(scatter)[0]))


def _active(sheet: SkinSheet, grid: SkinGrid) -> npt.NDArray[np.bool_]:
    """Return (nx, ns) True for cells of active skin: the pad's cells, or without a pad all but the outermost."""
    x_mm, s_mm = grid.x_mm, np.abs(grid.s_mm)
    if sheet.pad is None:
        along, across = (x_mm > x_mm[0]) & (x_mm < x_mm[-1]), s_mm < s_mm[-1]
    else:
        low, high, arc = (edge.to("mm") for edge in sheet.pad)
        along, across = (x_mm >= low) & (x_mm <= high), s_mm <= arc / 2
    return np.asarray(along[:, None] & across[None, :])
