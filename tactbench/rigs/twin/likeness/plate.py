"""A flat plate of any orientation against a finger that ends in a dome.

A tilted contact touches near its commanded place; a plate in a hand touches where the finger faces it. What is
approximated: the dome is a hemisphere of the finger's outer radius, laid out on the sheet by its axial coordinate; the
gap is measured along the plate's normal, and the skin gives way along its own.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray


def plate_normal(tilt_rad: float, azimuth_rad: float) -> FloatArray:
    """Return the direction from the finger to the plate: tilted from the pad's normal, azimuth 0 towards the tip."""
    sine = np.sin(tilt_rad)
    return np.array([sine * np.cos(azimuth_rad), sine * np.sin(azimuth_rad), -np.cos(tilt_rad)])


def plate_gap_mm(surface: tuple[FloatArray, ...], normal: FloatArray) -> FloatArray:
    """Return the (nx, ns) distance of the plate from the finger along its normal, zero where it touches first."""
    height = sum(component * place for component, place in zip(normal, surface, strict=True))
    return np.asarray(np.max(height) - height)
