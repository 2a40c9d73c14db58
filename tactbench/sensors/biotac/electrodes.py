"""Positions of the 19 electrodes on the core.

The same table is found in TAMS-Group/biotac_gazebo_plugin (``sim_biotac.h``) and in clear-nus/biotac_driver
(``biotac_logger_v3.py``): millimetres, x towards the tip, -z towards the pad, and the outward unit normals.
"""

from __future__ import annotations

from typing import NamedTuple

from tactbench.plugin import Source

TABLE = Source(
    tag="sourced",
    reference="TAMS-Group/biotac_gazebo_plugin sim_biotac.h, identical in clear-nus/biotac_driver "
    "biotac_logger_v3.py; normals printed there with three decimals, made exactly unit here",
)


class Electrode(NamedTuple):
    """One electrode; millimetres."""

    x_mm: float
    y_mm: float
    z_mm: float
    normal: tuple[float, float, float]


_SIDE = (0.0, -0.976, -0.220)
_LOWER = (0.0, -0.692, -0.722)
_FACET = (0.5, 0.0, -0.866)
_MIDLINE = (0.0, 0.0, -1.0)

# Electrodes 1-6; 11-16 are their mirror images in y.
_FLANK = (
    Electrode(0.993, -4.855, -1.116, (0.196, -0.956, -0.220)),
    Electrode(-2.700, -3.513, -3.670, _LOWER),
    Electrode(-6.200, -3.513, -3.670, _LOWER),
    Electrode(-8.000, -4.956, -1.116, _SIDE),
    Electrode(-10.500, -3.513, -3.670, _LOWER),
    Electrode(-13.400, -4.956, -1.116, _SIDE),
)


def _mirrored(electrode: Electrode) -> Electrode:
    x, y, z = electrode.normal
    return Electrode(electrode.x_mm, -electrode.y_mm, electrode.z_mm, (x, -y, z))


ELECTRODES: tuple[Electrode, ...] = (
    *_FLANK,
    Electrode(4.763, 0.000, -2.330, _FACET),
    Electrode(3.031, -1.950, -3.330, _FACET),
    Electrode(3.031, 1.950, -3.330, _FACET),
    Electrode(1.299, 0.000, -4.330, _FACET),
    *(_mirrored(electrode) for electrode in _FLANK),
    Electrode(-2.800, 0.000, -5.080, _MIDLINE),
    Electrode(-9.800, 0.000, -5.080, _MIDLINE),
    Electrode(-13.600, 0.000, -5.080, _MIDLINE),
)
"""Electrodes 1 to 19, in order."""

NAMES: tuple[str, ...] = tuple(f"E{number}" for number in range(1, len(ELECTRODES) + 1))
"""Their channels' names, in the same order."""
