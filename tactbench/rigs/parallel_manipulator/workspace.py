"""Whether the places of a straight move are permitted, and the way to a place that keeps the indenter off the sensor.

A move is permitted if its samples are: reach, joint ranges, assembly mode, distance from singularities. Between samples
of `SAMPLE_M` a joint may go on by 7 um and sigma fall by 0.005 (derived, at s = 0.15 and L = 250 mm: a joint turns at
one place at most, and abs(du/dx) <= 1/(s L)); that is left to the limits, which are assumed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import RigError
from tactbench.rigs.parallel_manipulator.kinematics import MODE, ROUNDING, LinearDelta, inverse, measures, solve_inverse

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

SAMPLE_M = 0.2e-3
"""Distance of samples along a move."""
WAY_POINT_M = 1e-3
"""Way points are at most so far apart: at each all rails come to rest, between them each runs by itself (assumed)."""
LEAST = 0.15
"""Of s, sigma_U and sigma_W (assumed: joint speeds and errors grow to at most 7 times)."""

Place = tuple[float, float, float]
"""x, y, z of the manipulator's point [m]."""


class PlaceRefusedError(RigError):
    """A place or a move is not permitted; nothing has moved."""


def margins(delta: LinearDelta, p_m: FloatArray) -> dict[str, FloatArray]:
    """Return by limit what is left to it at (n, 3) places [m], an (n,) each: m, rad or 1; below 0: it is not kept."""
    q, shortfall = solve_inverse(delta, p_m)
    found = measures(delta, p_m, q)
    low, high = delta.joint_range
    of_legs = {
        "reach": ROUNDING * delta.link_m - shortfall,
        "lowest joint value": q - low,
        "highest joint value": high - q,
        "s": found.serial - LEAST,
        "sideways angle": math.radians(delta.sideways_deg) - found.sideways_rad,
    }
    return {
        **{f"{name} of leg {leg + 1}": left[:, leg] for name, left in of_legs.items() for leg in range(3)},
        "assembly mode": MODE * found.det,
        "sigma_U": found.parallel - LEAST,
        "sigma_W": found.constraint - LEAST,
    }


def check_move(delta: LinearDelta, start_m: FloatArray, end_m: FloatArray) -> None:
    """Raise PlaceRefusedError unless the straight move between places (3,) [m] is permitted.

    Where it begins is not looked at: the platform stands there already.
    """
    count = max(1, math.ceil(float(np.linalg.norm(end_m - start_m)) / SAMPLE_M))
    places = start_m + np.arange(1, count + 1)[:, None] / count * (end_m - start_m)
    for name, left in margins(delta, places).items():
        if (left < 0).any():
            place = ", ".join(f"{1e3 * x:.2f}" for x in places[np.argmax(left < 0)])
            raise PlaceRefusedError(
                f"({place}) mm is not permitted: the {name} is beyond its limit.",
                hint="Nothing was moved. Choose another place or another way.",
            )


def way(
    delta: LinearDelta, here_m: Place, xy_m: tuple[float, float], clearance_m: float, stand_off_m: float
) -> list[Place]:
    """Return the places of a way: up to the clearance, sideways there, down to the stand-off above `xy_m`.

    Raises
    ------
    PlaceRefusedError
        If one is not permitted; nothing has moved.
    """
    top_m = max(here_m[2], clearance_m)
    places: list[Place] = [here_m, (*here_m[:2], top_m), (*xy_m, top_m), (*xy_m, stand_off_m)]
    for start, end in pairwise(places):
        check_move(delta, np.array(start), np.array(end))
    return places


def way_points(delta: LinearDelta, places: list[Place]) -> Iterator[list[float]]:
    """Yield the joint values [m] of the way points of a way."""
    for start, end in pairwise(np.array(place) for place in places):
        pieces = math.ceil(float(np.linalg.norm(end - start)) / WAY_POINT_M)
        for n in range(1, pieces + 1):
            yield inverse(delta, start + n / pieces * (end - start)).tolist()
