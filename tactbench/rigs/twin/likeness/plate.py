"""A flat plate of any orientation against a finger that ends in a dome.

The sheet knows small tilts only: there the gap is linear along the finger, and a plate tilted by 29 degrees would stand
on the sheet's edge. Here the plate touches the dome where the dome faces it. What is approximated: the dome is a
hemisphere of the finger's outer radius, begins at x = 0, and is laid out on the sheet by the sensor's own shortened
meridian (half of the real arc); the gap is measured along the plate's normal, and the skin gives way along its own.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray, SkinGrid


def finger_surface(grid: SkinGrid, outer_radius_mm: float, dome_arc_mm: float) -> tuple[FloatArray, ...]:
    """Return x, y, z [mm] of the (nx, ns) cells' places on a cylinder with a dome.

    Parameters
    ----------
    grid
        The unrolled skin.
    outer_radius_mm
        Of cylinder and dome.
    dome_arc_mm
        How much of the sheet's x one radian of the dome takes.
    """
    theta = grid.s_mm[None, :] / outer_radius_mm
    x = grid.x_mm[:, None]
    polar = np.maximum(x, 0.0) / dome_arc_mm
    distance = outer_radius_mm * np.cos(polar)
    along = np.where(x > 0, outer_radius_mm * np.sin(polar), x) + np.zeros_like(theta)
    return along, distance * np.sin(theta), -distance * np.cos(theta)


def plate_normal(tilt_rad: float, azimuth_rad: float) -> FloatArray:
    """Return the direction from the finger to the plate: tilted from the pad's normal, azimuth 0 towards the tip."""
    sine = np.sin(tilt_rad)
    return np.array([sine * np.cos(azimuth_rad), sine * np.sin(azimuth_rad), -np.cos(tilt_rad)])


def plate_gap_mm(surface: tuple[FloatArray, ...], normal: FloatArray) -> FloatArray:
    """Return the (nx, ns) distance of the plate from the finger along its normal, zero where it touches first."""
    height = sum(component * place for component, place in zip(normal, surface, strict=True))
    return np.asarray(np.max(height) - height)
