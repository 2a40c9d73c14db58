"""The middle of the film between core and skin: where current really flows."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.sensors.biotac.meshes import RAYS_FROM_MM, core_reach_mm


def mid_film_mm(
    x_mm: FloatArray, angle_rad: FloatArray, film_mm: FloatArray, outer_mm: float, dome_mm: float
) -> FloatArray:
    """Return the (nx, ns, 3) places of the film's middle.

    Parameters
    ----------
    x_mm, angle_rad
        (nx,), (ns,) sheet's axial coordinates and angles around the finger, within a right angle of the midline.
    film_mm
        (nx, ns) thickness.
    outer_mm, dome_mm
        Radius of the finger's outer surface, and where its dome begins.
    """
    x = x_mm[:, None]
    behind = np.minimum(x, RAYS_FROM_MM)
    ring = np.sqrt(np.maximum(outer_mm**2 - np.maximum(x - dome_mm, 0.0) ** 2, 0.0))
    ray = np.arctan2(x - behind, ring)
    middle = core_mm(behind, ray, angle_rad) + film_mm / 2
    height = middle * np.cos(ray)
    around = angle_rad[None, :]
    return np.stack([behind + middle * np.sin(ray), height * np.sin(around), -height * np.cos(around)], axis=-1)


def core_mm(from_mm: FloatArray, ray_rad: FloatArray, angle_rad: FloatArray) -> FloatArray:
    """Return :func:`core_reach_mm` of places, rays and angles, which broadcast."""
    return np.asarray(np.frompyfunc(core_reach_mm, 3, 1)(from_mm, ray_rad, angle_rad), dtype=np.float64)
