"""The core's surface, what of the skin lies over it, and the middle of the film between: where current really flows.

The electrodes' frame: x along the finger towards the tip, the pad at -z. Up to x = 1.8 mm what faces a point of the
core is what lies radially above it; beyond, what lies on the ray from (1.8 mm, axis) through it. The sheet's own axial
coordinate is that of the finger's outer surface.
"""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.sensors.biotac.electrodes import ELECTRODES

MESHES = (
    "NVlabs/biotac_sim int_ext_skin_combined_ftw.tet and top_side_core_bc.obj, x = -12.2 mm - x of the meshes, whose "
    "axis points the other way"
)
CORE_MM = 5.33
"""Radius of the core, cylinder and tip; MESHES."""
ELECTRODES_MM = 5.08
"""Radius on which the electrode table lies, sqrt(3.513² + 3.670²): the electrodes are let in by the difference."""
RAYS_FROM_MM = 1.8
"""Centre of the tip's rays, and of the core's tip: 1.8 + 5.33 = 7.13 mm, the meshes' 7.1."""
_E7 = ELECTRODES[6]
_AXIAL, _DOWN = _E7.normal[0], -_E7.normal[2]
_FACET_MM = _AXIAL * (_E7.x_mm - RAYS_FROM_MM) - _DOWN * _E7.z_mm + CORE_MM - ELECTRODES_MM
"""Distance from the rays' centre of the flat that the tip's electrodes are let into, as deep as the others."""


def sheet_x(x_mm: float, height_mm: float, outer_mm: float, dome_mm: float) -> float:
    """Return the sheet's axial coordinate of what faces a point of the core.

    Parameters
    ----------
    x_mm, height_mm
        Axial place, and distance from the axis.
    outer_mm, dome_mm
        Radius of the finger's outer surface, and where its dome begins.
    """
    if x_mm <= RAYS_FROM_MM:
        return x_mm
    return ray_on_sheet(float(np.arctan2(x_mm - RAYS_FROM_MM, height_mm)), outer_mm, dome_mm)


def ray_on_sheet(angle_rad: float, outer_mm: float, dome_mm: float) -> float:
    """Return the sheet's axial coordinate where a ray meets the outer surface; 0 is straight up from the axis."""
    return float(RAYS_FROM_MM + ray_length(angle_rad, outer_mm, dome_mm) * np.sin(angle_rad))


def ray_length(angle_rad: float, outer_mm: float, dome_mm: float) -> float:
    """Return how far a ray goes to the outer surface."""
    ahead = RAYS_FROM_MM - dome_mm
    # |(ahead + t sine, t cosine)| = outer radius, seen from the dome's centre.
    return float(np.sqrt(outer_mm**2 - (ahead * np.cos(angle_rad)) ** 2) - ahead * np.sin(angle_rad))


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
    """Return how far the core reaches along rays from places of the axis, up to RAYS_FROM_MM.

    Parameters
    ----------
    from_mm, ray_rad, angle_rad
        Axial places, angles from straight up and angles around the finger; they broadcast.
    """
    # Where the ray meets the facet; away from it, where the facet bends back, the core's own radius.
    leaning = np.maximum(_AXIAL * np.sin(ray_rad) + _DOWN * np.cos(ray_rad) * np.cos(angle_rad), 1e-9)
    return np.asarray(np.minimum(CORE_MM, (_FACET_MM + _AXIAL * (RAYS_FROM_MM - from_mm)) / leaning))
