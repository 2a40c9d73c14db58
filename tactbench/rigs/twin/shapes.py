"""Shapes of indenters as heights in millimetres over a plane.

The module holds the shapes that this package provides, and the code that prepares any plugin's shape for pressing.
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
