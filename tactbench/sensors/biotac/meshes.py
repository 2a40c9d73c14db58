"""Shapes of the BioTac's core, film and outer surface from the public meshes, as tables and formulas.

Coordinates are those of the electrodes: x along the finger towards the tip, the pad at -z. Up to x = 1.8 mm, distances
from the core are radial; beyond, they lie on rays from the point x = 1.8 mm of the axis. The sheet's axial coordinate
is that of the finger's outer surface.
"""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import FloatArray, Source
from tactbench.plugin.simulation import SheetTable
from tactbench.sensors.biotac.channels import ELECTRODES

MESHES = (
    "NVlabs/biotac_sim int_ext_skin_combined_ftw.tet and top_side_core_bc.obj, x = -12.2 mm - x of the meshes, whose "
    "axis points the other way"
)
CORE_MM = 5.33
"""Radius of the core's cylinder and tip, from the public meshes (MESHES)."""
ELECTRODES_MM = 5.08
"""Radius on which the electrodes lie, sqrt(3.513² + 3.670²): smaller than the core's, as they are recessed into it."""
RAYS_FROM_MM = 1.8
"""Axial place of the centre of the tip's rays and the core's round tip, which ends at 1.8 + 5.33 mm (meshes: 7.1)."""
_E7 = ELECTRODES[6]
_AXIAL, _DOWN = _E7.normal[0], -_E7.normal[2]
_FACET_MM = _AXIAL * (_E7.x_mm - RAYS_FROM_MM) - _DOWN * _E7.z_mm + CORE_MM - ELECTRODES_MM
"""Distance from the rays' centre to the flat with the tip's electrodes, which are recessed as deep as the others."""


def sheet_x(x_mm: float, height_mm: float, outer_mm: float, dome_mm: float) -> float:
    """Return the sheet's axial coordinate [mm] opposite to a point of the core at `x_mm`, `height_mm` from the axis.

    `outer_mm` is the radius of the finger's outer surface, whose dome begins at `dome_mm`.
    """
    if x_mm <= RAYS_FROM_MM:
        return x_mm
    return ray_on_sheet(math.atan2(x_mm - RAYS_FROM_MM, height_mm), outer_mm, dome_mm)


def ray_on_sheet(angle_rad: float, outer_mm: float, dome_mm: float) -> float:
    """Return the sheet's axial coordinate [mm] where a ray ends at the outer surface; angle 0: normal to the axis."""
    return RAYS_FROM_MM + ray_length(angle_rad, outer_mm, dome_mm) * math.sin(angle_rad)


def ray_length(angle_rad: float, outer_mm: float, dome_mm: float) -> float:
    """Return the length [mm] of a ray of the tip up to the outer surface."""
    ahead = RAYS_FROM_MM - dome_mm
    # |(ahead + t sine, t cosine)| = outer radius, seen from the dome's centre.
    return math.sqrt(outer_mm**2 - (ahead * math.cos(angle_rad)) ** 2) - ahead * math.sin(angle_rad)


def core_reach_mm(from_mm: FloatArray, ray_rad: FloatArray, angle_rad: FloatArray) -> FloatArray:
    """Return the extents [mm] of the core along rays from places `from_mm` (at most RAYS_FROM_MM) on the axis.

    `ray_rad` are the rays' angles from the perpendicular to the axis, `angle_rad` the angles around the finger; the
    three broadcast.
    """
    # Where the ray meets the facet; away from it, where the facet bends back, the core's own radius.
    leaning = np.maximum(_AXIAL * np.sin(ray_rad) + _DOWN * np.cos(ray_rad) * np.cos(angle_rad), 1e-9)
    return np.minimum(CORE_MM, (_FACET_MM + _AXIAL * (RAYS_FROM_MM - from_mm)) / leaning)


ANGLES_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0)
AT_X_MM: dict[float, tuple[float, ...]] = {
    -17.2: (0.10,) * 10,
    -17: (0.19, 0.20, 0.16, 0.18, 0.16, 0.15, 0.12, 0.15, 0.15, 0.14),
    -16: (0.34, 0.39, 0.36, 0.36, 0.32, 0.29, 0.23, 0.20, 0.16, 0.15),
    -15: (0.59, 0.63, 0.60, 0.58, 0.52, 0.44, 0.38, 0.31, 0.22, 0.16),
    -14: (0.80, 0.84, 0.79, 0.75, 0.68, 0.59, 0.49, 0.38, 0.26, 0.16),
    -13: (0.96, 1.00, 0.95, 0.88, 0.80, 0.69, 0.58, 0.43, 0.28, 0.15),
    -12: (1.08, 1.11, 1.06, 0.99, 0.89, 0.76, 0.61, 0.46, 0.28, 0.15),
    -10: (1.23, 1.26, 1.19, 1.10, 0.99, 0.84, 0.65, 0.49, 0.29, 0.15),
    -8: (1.31, 1.33, 1.25, 1.15, 1.02, 0.86, 0.66, 0.48, 0.28, 0.14),
    -6: (1.32, 1.35, 1.28, 1.17, 1.04, 0.86, 0.66, 0.47, 0.27, 0.14),
    -4: (1.33, 1.35, 1.27, 1.16, 1.03, 0.86, 0.65, 0.48, 0.28, 0.14),
    -2: (1.29, 1.32, 1.24, 1.13, 1.00, 0.84, 0.64, 0.47, 0.27, 0.13),
    0: (1.24, 1.24, 1.15, 1.05, 0.93, 0.78, 0.61, 0.45, 0.26, 0.14),
    1: (1.53, 1.44, 1.23, 1.05, 0.88, 0.73, 0.56, 0.41, 0.24, 0.13),
}  # fmt: skip
"""Film thickness [mm] by axial place [mm] and angle: inner skin less core, mean of left and right (they differ by
.011 mm on average; error by the meshes' edges of .6-.8 mm: .03 mm). -17.2 mm, the seal, is computed: see SOURCE."""
AT_RAY_DEG: dict[float, tuple[float, ...]] = {
    5: (2.04, 1.96, 1.69, 1.27, 0.92, 0.67, 0.53, 0.38, 0.23, 0.11),
    15: (2.32, 2.24, 2.01, 1.61, 1.12, 0.70, 0.52, 0.39, 0.26, 0.15),
    25: (2.45, 2.37, 2.15, 1.77, 1.27, 0.81, 0.54, 0.41, 0.31, 0.18),
    35: (2.38, 2.32, 2.12, 1.80, 1.34, 0.88, 0.59, 0.42, 0.32, 0.22),
    45: (2.17, 2.12, 1.95, 1.67, 1.28, 0.87, 0.61, 0.45, 0.37, 0.28),
    55: (1.79, 1.74, 1.60, 1.37, 1.06, 0.81, 0.59, 0.47, 0.40, 0.32),
    65: (1.25, 1.21, 1.12, 0.98, 0.80, 0.60, 0.55, 0.48, 0.40, 0.34),
    75: (0.73, 0.73, 0.70, 0.65, 0.60, 0.52, 0.48, 0.45, 0.41, 0.38),
    85: (0.45, 0.46, 0.47, 0.46, 0.45, 0.44, 0.43, 0.44, 0.44, 0.42),
}  # fmt: skip
"""Film thickness [mm] at the tip, by the ray's angle [deg] from straight down towards the tip."""
_FILM_MM = (*AT_X_MM.values(), *AT_RAY_DEG.values())
SOURCE = Source(
    tag="derived",
    reference=f"inner skin less core, {MESHES}; at the seal the law max(min(.13, g), .05 + (g - .05) cos(angle)) "
    "through x <= 0 (rms .026 mm), g = .10 mm",
)


def film_table(outer_mm: float, dome_mm: float) -> SheetTable:
    """Return the film thickness of the meshes on a sheet with the radius `outer_mm`, whose dome begins at `dome_mm`."""
    return SheetTable(x_mm=_places(outer_mm, dome_mm), angle_deg=ANGLES_DEG, value_mm=_FILM_MM, source=SOURCE)


def relief_table(outer_mm: float, dome_mm: float, skin_mm: float) -> SheetTable:
    """Return how far the skin's surface lies inside the ideal cylinder and dome, if the skin is equally thick."""
    reach = [(x, 0.0, outer_mm) for x in AT_X_MM]
    for degrees in AT_RAY_DEG:
        ray = math.radians(degrees)
        reach.append((RAYS_FROM_MM, ray, ray_length(ray, outer_mm, dome_mm)))
    begin, ray, way = np.array(reach).T[:, :, None]
    depth = way - (core_reach_mm(begin, ray, np.radians(ANGLES_DEG)) + np.array(_FILM_MM) + skin_mm)
    rows = tuple(map(tuple, np.round(depth, 3).tolist()))
    return SheetTable(
        x_mm=_places(outer_mm, dome_mm),
        angle_deg=ANGLES_DEG,
        value_mm=rows,
        source=Source(
            tag="derived",
            reference=f"core, film and a skin of one thickness, {MESHES}: a circle of 7.11 mm about 1.1 mm below the "
            "core's axis (rms .02 mm); such a skin has 1660 mm^3, the mesh 1631",
        ),
    )


def _places(outer_mm: float, dome_mm: float) -> tuple[float, ...]:
    """Return the sheet's axial coordinates [mm] of the rows of both film tables."""
    rays = (ray_on_sheet(math.radians(angle), outer_mm, dome_mm) for angle in AT_RAY_DEG)
    return (*AT_X_MM, *rays)
