"""Geometry in millimetres: the grid of the unrolled skin, shapes of indenters, and the gap between skin and indenter.

``x`` runs along the finger, ``s`` along the arc of its outer surface; ``theta = s / outer radius``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tactbench.plugin import (
    FloatArray,
    Indenter,
    IndenterDescriptor,
    PluginContractError,
    RigError,
    UsageError,
    load_object,
)
from tactbench.plugin.simulation import Dome, SkinGrid, SkinSheet

STEEPEST = 1.0
"""Largest allowed slope of an indenter, 45 degrees: the gap is measured along the press axis and the deflection along
the skin's normal, directions that agree for gentle slopes only."""
_FEWEST_CELLS = 4
BEYOND_MM = 50.0
"""Height given to a shape where it is vertical, or where it has no body: large, finite, never touched by the skin.
"""
RIM = 0.999
"""Share of a round body's radius up to which the body is modelled: at its rim the flank is vertical, which a height
field cannot represent."""
_STEP_MM = 1e-4
"""Half of the step over which a slope is computed by differences: far below a cell's width, far above rounding."""


@dataclass(frozen=True)
class Shape:
    """An indenter that is neither flat nor a cap, with its dimensions and orientation."""

    name: str
    sizes: tuple[tuple[str, float], ...]
    """Names and values of the shape's dimensions; each value is in the unit of its dimension."""
    angle: float
    """Rotation about the press axis, from x towards s [rad]."""
    height: Callable[..., FloatArray] = field(repr=False, compare=False)

    def height_mm(self, x_mm: FloatArray, s_mm: FloatArray) -> FloatArray:
        """Return the height of the shape above its lowest point, at places (broadcast) from its axis along x and s.

        Raises
        ------
        PluginContractError
            If the plugin's function returns an array of wrong dimensions, or numbers that are not finite.
        """
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        x, y = np.broadcast_arrays(cos * x_mm + sin * s_mm, cos * s_mm - sin * x_mm)
        found = np.asarray(self.height(x, y, **dict(self.sizes)), dtype=np.float64)
        if found.shape != x.shape or not np.all(np.isfinite(found)):
            raise PluginContractError(
                f"The height function of indenter {self.name!r} returned an array of shape {found.shape} with "
                f"{np.count_nonzero(~np.isfinite(found))} values that are not finite; {x.shape} finite values are "
                "expected.",
                hint="Return a large height, 50 mm or more, where there is no body.",
            )
        return found

    def slope(self, x_mm: FloatArray, s_mm: FloatArray) -> FloatArray:
        """Return the absolute slope [1] of the shape at places (x, s) relative to its axis."""
        along = self.height_mm(x_mm + _STEP_MM, s_mm) - self.height_mm(x_mm - _STEP_MM, s_mm)
        across = self.height_mm(x_mm, s_mm + _STEP_MM) - self.height_mm(x_mm, s_mm - _STEP_MM)
        return np.hypot(along, across) / (2 * _STEP_MM)


@dataclass(frozen=True)
class Contact:
    """Place, tilt and shape of an indenter on the skin."""

    radius_mm: float
    """Radius of a spherical cap; infinite for a flat surface and any other shape."""
    x_mm: float
    """Position of the indenter's apex along the finger, in the sheet's coordinates."""
    s_mm: float
    """Position of the indenter's apex along the arc of the finger's surface."""
    tilt_x: float = 0.0
    """Slope [1], rise over run, of the tilted indenter along the finger."""
    tilt_s: float = 0.0
    """Slope [1], rise over run, of the tilted indenter across the finger."""
    shape: Shape | None = None
    """Shape of an indenter that is neither flat nor a cap."""


def skin_grid(sheet: SkinSheet, cells: tuple[int, int] | None = None) -> SkinGrid:
    """Return the cell centres of `sheet`, ``x_min + (i + 1/2) dx`` and ``-arc/2 + (j + 1/2) ds``.

    `cells` (numbers along x and s) replaces the sheet's own numbers of cells.

    Raises
    ------
    RigError
        If the sheet has no area or no positive radius, or fewer than four cells either way.
    """
    along, across = cells or sheet.cells
    x_min, x_max, arc = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm")
    outer = outer_radius_mm(sheet)
    if not (0 < x_max - x_min < math.inf and 0 < arc < math.inf and outer > 0 and min(along, across) >= _FEWEST_CELLS):
        raise RigError(
            f"The skin's sheet runs from x = {x_min:g} to {x_max:g} mm and {arc:g} mm across, on a radius of {outer:g} "
            f"mm, in {along} x {across} cells.",
            hint=f"Give positive, finite sides and radius, and at least {_FEWEST_CELLS} cells along x and s.",
        )
    dx, ds = (x_max - x_min) / along, arc / across
    x: FloatArray = x_min + (np.arange(along, dtype=np.float64) + 0.5) * dx
    s: FloatArray = -arc / 2 + (np.arange(across, dtype=np.float64) + 0.5) * ds
    return SkinGrid(x_mm=x, s_mm=s)


def outer_radius_mm(sheet: SkinSheet) -> float:
    """Return the radius [mm] of the finger's outer surface; infinity for a flat pad."""
    return math.inf if sheet.outer_radius is None else sheet.outer_radius.to("mm")


def gap_mm(grid: SkinGrid, contact: Contact, sheet: SkinSheet | None = None) -> FloatArray:
    """Return the (nx, ns) gap between unloaded skin and indenter at zero approach; a skin without a sheet is flat.

    The press axis is the skin's normal at the contact, on the dome as on the cylinder, also for a skin with a relief.
    The depth of the finger's surface below the tangent plane (``2 Ro sin²(theta/2)`` on the cylinder) and the height
    ``r² / (R + sqrt(R² - r²))`` of the cap are computed without cancellation: R = 1e9 mm and a flat surface agree to
    rounding. For a tilted indenter the smallest gap is subtracted, so that the approach is 0 at first touch.
    """
    x, y, fall = around_mm(grid, contact, sheet)
    own = sag_mm(x**2 + y**2, contact.radius_mm) if contact.shape is None else contact.shape.height_mm(x, y)
    gap: FloatArray = fall + own
    if contact.tilt_x or contact.tilt_s:
        gap = gap + contact.tilt_x * x + contact.tilt_s * y
        gap = gap - gap.min()
    return gap


def around_mm(
    grid: SkinGrid, contact: Contact, sheet: SkinSheet | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the positions of the finger's surface relative to the contact: along, across, below the tangent plane.

    Each of the three arrays broadcasts to (nx, ns).

    A point at meridian angle phi (0 on the cylinder) and angle theta from the contact lies at ``(X, Ro cos(phi)
    sin(theta), -Ro cos(phi) cos(theta))`` with ``sin(phi) = (X - start) / Ro`` on the dome; the differences
    to the contact's own point are turned by its meridian angle.
    """
    if sheet is None or math.isinf(outer_radius_mm(sheet)):
        return grid.x_mm[:, None] - contact.x_mm, grid.s_mm[None, :] - contact.s_mm, np.zeros((1, 1))
    radius, dome, relief = outer_radius_mm(sheet), sheet.dome, sheet.relief
    theta = (grid.s_mm[None, :] - contact.s_mm) / radius
    phi, axial = _meridian(grid.x_mm[:, None], radius, dome)
    (phi0,), (axial0,) = _meridian(np.array([contact.x_mm]), radius, dome)
    ring = radius * np.cos(phi)
    along = axial - axial0
    # cos(phi0) - cos(phi) cos(theta), without the difference of two numbers near one.
    below = 2.0 * radius * np.sin((phi + phi0) / 2) * np.sin((phi - phi0) / 2) + 2.0 * ring * np.sin(theta / 2) ** 2
    across = ring * np.sin(theta)
    if relief is not None:
        own = relief.at(np.array([contact.x_mm]), np.array([contact.s_mm / radius]))[0, 0]
        inside = relief.at(grid.x_mm, grid.s_mm / radius)
        along = along - inside * np.sin(phi) + own * np.sin(phi0)
        across = across - inside * np.cos(phi) * np.sin(theta)
        below = below + inside * np.cos(phi) * np.cos(theta) - own * np.cos(phi0)
    return (
        np.cos(phi0) * along + np.sin(phi0) * below,
        across,
        np.cos(phi0) * below - np.sin(phi0) * along,
    )


def _meridian(x_mm: FloatArray, radius: float, dome: Dome | None) -> tuple[FloatArray, FloatArray]:
    """Return the meridian angle at `x_mm`, and `x_mm` limited to the axial range of the finger's surface."""
    if dome is None:
        return np.zeros_like(x_mm), x_mm
    start = dome.start.to("mm")
    return np.arcsin(np.clip((x_mm - start) / radius, 0.0, 1.0)), np.minimum(x_mm, start + radius)


def check_contact(grid: SkinGrid, contact: Contact) -> None:
    """Raise an error for a contact that the grid cannot resolve or that lies off the skin.

    Raises
    ------
    RigError
        If the cap's radius is smaller than a cell, or another shape rises by more than a cell within a cell of its
        axis; if it is tilted by more than 45 degrees; or if its apex is off the sheet.
    """
    dx, ds = grid.cell_mm
    cell = max(dx, ds)
    if not contact.radius_mm >= cell:
        raise RigError(
            f"A cap of radius {contact.radius_mm:g} mm is smaller than a cell of the skin ({dx:.2f} x {ds:.2f} mm): "
            "the contact would be one cell wide whatever the load.",
            hint=f"Use a radius of at least {3 * cell:.1f} mm, or a sensor spec with more cells.",
        )
    if (shape := contact.shape) is not None:
        around = np.linspace(0.0, 2 * np.pi, 64, endpoint=False)
        risen = float(shape.height_mm(cell * np.cos(around), cell * np.sin(around)).max())
        if not risen <= cell * (1 + 1e-9):  # rounding of a flank at exactly 45 degrees
            sizes = ", ".join(f"{name} {value:g}" for name, value in shape.sizes)
            raise RigError(
                f"The indenter {shape.name!r} ({sizes}) rises by {risen:.3g} mm within {cell:.2f} mm, a cell of the "
                f"skin; at most {cell:.2f} mm, 45 degrees, is allowed.",
                hint="Use a blunter or wider indenter, or a sensor spec with more cells.",
            )
    slope = math.hypot(contact.tilt_x, contact.tilt_s)
    if not slope <= STEEPEST:
        raise RigError(
            f"The indenter is tilted to a slope of {slope:.3g}; at most {STEEPEST:g}, 45 degrees, is allowed.",
            hint="Correct tilt_x and tilt_s of the scene's placement.",
        )
    x_low, x_high = grid.x_mm[0] - dx / 2, grid.x_mm[-1] + dx / 2
    s_high = grid.s_mm[-1] + ds / 2
    if not (x_low <= contact.x_mm <= x_high and abs(contact.s_mm) <= s_high):
        raise RigError(
            f"The contact point x = {contact.x_mm:.2f} mm, s = {contact.s_mm:.2f} mm lies outside the skin "
            f"(x from {x_low:.2f} to {x_high:.2f} mm, |s| up to {s_high:.2f} mm).",
            hint="Correct the scene's placement, or contact_x and contact_s among the sensor's parameters.",
        )


def shape_of(indenter: Indenter, installed: Sequence[IndenterDescriptor]) -> Shape | None:
    """Return the shape that a scene names; None for a cap or a flat surface, which the radius describes.

    Raises
    ------
    RigError
        If no such shape is installed.
    UsageError
        If a dimension is unknown, in a wrong unit, or out of its range.
    """
    if indenter.shape is None:
        return None
    for descriptor in installed:
        if descriptor.name == indenter.shape:
            sizes = tuple(descriptor.sizes(indenter.dimensions).items())
            return Shape(indenter.shape, sizes, indenter.angle.to("rad"), load_object(descriptor.where))
    known = ", ".join(sorted({"cap", "flat", *(one.name for one in installed)}))
    raise RigError(f"No installed indenter is called {indenter.shape!r}.", hint=f"Choose one of: {known}.")


def cap(x_mm: FloatArray, y_mm: FloatArray, *, radius: float) -> FloatArray:
    """Return the height [mm] of a spherical cap of `radius` mm above its apex."""
    return sag_mm(x_mm**2 + y_mm**2, radius)


def flat(x_mm: FloatArray, y_mm: FloatArray) -> FloatArray:
    """Return the height, 0 mm everywhere, of a flat surface without an edge."""
    return np.zeros(np.broadcast_shapes(x_mm.shape, y_mm.shape))


def cylinder(x_mm: FloatArray, y_mm: FloatArray, *, radius: float) -> FloatArray:
    """Return the height [mm] of an endless cylinder that lies along x, above its lowest line."""
    return sag_mm(y_mm**2 + 0.0 * x_mm, radius)


def edge(x_mm: FloatArray, y_mm: FloatArray, *, wedge_angle: float, tip_radius: float) -> FloatArray:
    """Return the height of an endless wedge along x: two flanks with `wedge_angle` [deg] between them.

    The flanks are tangents of the rounded tip, with the slope ``1/tan(angle/2)``.
    """
    slope = 1.0 / math.tan(math.radians(wedge_angle) / 2)
    away = np.abs(y_mm + 0.0 * x_mm)
    if tip_radius == 0:
        return slope * away
    leaves = tip_radius * slope / math.hypot(1.0, slope)
    return sag_mm(np.minimum(away, leaves) ** 2, tip_radius) + slope * np.maximum(away - leaves, 0.0)


def pin(x_mm: FloatArray, y_mm: FloatArray, *, radius: float, fillet: float) -> FloatArray:
    """Return the height of an upright pin with a flat end: its rim is rounded by `fillet`, its side is vertical.

    Raises
    ------
    UsageError
        If the fillet is larger than the pin's radius.
    """
    if fillet > radius:
        raise UsageError(
            f"The indenter 'pin' has a fillet of {fillet:g} mm; at most its radius, {radius:g} mm, is expected.",
            hint="Choose a smaller fillet; a pin with a fillet equal to its radius is a cap.",
        )
    r = np.hypot(x_mm, y_mm)
    if fillet == 0:
        return np.where(r <= radius, 0.0, BEYOND_MM)
    return sag_mm(np.maximum(r - (radius - fillet), 0.0) ** 2, fillet)


def sag_mm(r2: FloatArray, radius: float) -> FloatArray:
    """Return the height of a circle above its lowest point at a squared distance from it; 0 for an infinite radius.

    The formula ``r² / (R + sqrt(R² - r²))`` avoids cancellation.
    """
    if math.isinf(radius):
        return np.zeros_like(r2)
    exists = r2 < (RIM * radius) ** 2
    inside = np.where(exists, r2, 0.0)
    return np.where(exists, inside / (radius + np.sqrt(radius**2 - inside)), radius + BEYOND_MM)
