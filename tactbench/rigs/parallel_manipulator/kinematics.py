"""A linear delta robot: geometry, inverse and forward kinematics, distance from singularities, permitted moves.

Leg i stands at azimuth phi_i, with e = (cos phi, sin phi, 0), t = (-sin phi, cos phi, 0), z up. Parallelograms keep the
platform parallel to its base, so the platform's radius is subtracted from the base's and each leg is one link of length
L from its joint centre to the point p of the platform (derived; the same folding in R. L. Williams II, The Delta
Parallel Robot: Kinematics Solutions, 2015):

    c(q) = A + q d,  A = (R_b - r_p) e,  d = cos(alpha) e + sin(alpha) z,  |p - c_i(q_i)| = L_i

Inverse: w = p - A, s = d.w, n = |w - s d|, q = s + sqrt((L - n)(L + n)): carriages are ahead of the platform.

Forward, three spheres: a = c2 - c1, b = c3 - c1, n = a x b, x = (A'(b x n) + B'(n x a))/|n|^2 with
A' = (|a|^2 + L1^2 - L2^2)/2 and B' = (|b|^2 + L1^2 - L3^2)/2, h = sqrt((L1 - |x|)(L1 + |x|)),
p = c1 + x - h n/|n|: it is assembled so that det(p - c1, p - c2, p - c3) < 0. The lower of both solutions is the wrong
one at some places.

Near a singularity, with unit links u_i = (p - c_i)/L_i, all measures without units, 1 is best:

| kind | when | measure |
|---|---|---|
| serial | a link perpendicular to its rail | s = least abs(u_i.d_i): a joint's speed is the platform's/s |
| parallel | links coplanar, or two centres coincide | sigma_U of rows u_i: errors are the joints'/sigma_U |
| constraint | parallelograms flat, or all links in a plane with z | sigma_W of rows t_i x u_i: the platform can turn |

A move is permitted if its samples are: reach, joint ranges, assembly mode, distance from singularities. Between samples
of `SAMPLE_M` a joint may go on by 7 um and sigma fall by 0.005 (at s = 0.15 and L = 250 mm: a joint turns at one place
at most, and abs(du/dx) <= 1/(s L)); that is left to the limits, which are assumed.

All derived. Files state mm and deg, which become m and rad here. Karl et al. 2016 name neither a mechanism nor a
geometry: that it is a delta is this project's assumption, and so is every number that is shipped.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from tactbench.plugin import RigError, Source, UsageError
from tactbench.plugin.devices import Options

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

ROUNDING = 1e-12
"""Permitted closure error as part of a link's length: distances of metres have errors of a few 1e-16 of themselves,
geometry files a few more; three digits are spare."""
SAMPLE_M = 0.2e-3
"""Distance of the tested samples along a move [m]."""
WAY_POINT_M = 1e-3
"""Largest distance of way points [m]; all rails stop at each way point, and run independently in between (assumed)."""
LEAST = 0.15
"""Least permitted s, sigma_U and sigma_W (assumed: joint speeds and errors grow at most 7 times)."""
MODE = -1
"""Sign of det(p - c1, p - c2, p - c3) with carriages ahead of the platform; constant along every permitted move."""
Length = Annotated[float, Field(gt=0, le=1e5)]
Place = tuple[float, float, float]
"""Coordinates x, y, z of the manipulator's point [m]."""


def _for_each_leg(value: Any) -> Any:
    return (value,) * 3 if isinstance(value, int | float) else value


PerLeg = Annotated[tuple[float, float, float], BeforeValidator(_for_each_leg)]
"""Three numbers, one for each leg; or one number for all legs."""
PositivePerLeg = Annotated[tuple[Length, Length, Length], BeforeValidator(_for_each_leg)]


class ClosureError(RigError):
    """The three links do not meet at the given joint values, or the joint values determine no place."""


class PlaceRefusedError(RigError):
    """A place or a move of the manipulator is not permitted; nothing has moved."""


class LinearDelta(Options):
    """Three carriages on straight rails, vertical or inclined; q is a carriage's position along its rail from A [m]."""

    kind: Literal["linear-delta"] = "linear-delta"
    title: str
    """Name of the machine, shown with results of its kinematics; the shipped machine is called an example."""
    source: Source
    """Origin of these numbers: `measured` on the machine, `sourced` from its drawings, or `assumed`."""
    azimuth_deg: PerLeg = (0.0, 120.0, 240.0)
    """Azimuth of each leg about z [deg]."""
    base_radius_mm: PositivePerLeg
    """Distance from the axis to the zero of each joint [mm]."""
    platform_radius_mm: PositivePerLeg
    """Distance from the platform's axis to the joint of each link [mm]."""
    link_mm: PositivePerLeg
    """Length of each link between its joints [mm]."""
    inclination_deg: PerLeg = (90.0, 90.0, 90.0)
    """Angle of each rail above the horizontal, outwards [deg]; 90: vertical."""
    joint_lowest_mm: PerLeg
    """Least and greatest permitted position of each carriage [mm]."""
    joint_highest_mm: PerLeg
    sideways_deg: Annotated[float, Field(gt=0, lt=90)] = 30.0
    """Largest angle of a link out of its leg's plane (assumed: rod ends of ordinary size)."""

    @model_validator(mode="after")
    def _sound(self) -> Self:
        if (self.joint_range[0] >= self.joint_range[1]).any():
            raise ValueError("joint_lowest_mm must be below joint_highest_mm")
        return self

    @cached_property
    def radial(self) -> FloatArray:
        """Radial unit vectors e, (3, 3): one row for each leg."""
        phi = np.radians(self.azimuth_deg)
        return np.stack([np.cos(phi), np.sin(phi), np.zeros(3)], axis=1)

    @cached_property
    def sideways(self) -> FloatArray:
        """Sideways unit vectors t, (3, 3): one row for each leg."""
        return np.stack([-self.radial[:, 1], self.radial[:, 0], np.zeros(3)], axis=1)

    @cached_property
    def anchor_m(self) -> FloatArray:
        """Zeros A of the joints, less the platform's radius [m], (3, 3): one row for each leg."""
        folded = np.subtract(self.base_radius_mm, self.platform_radius_mm)
        return np.asarray(1e-3 * folded[:, None] * self.radial)

    @cached_property
    def link_m(self) -> FloatArray:
        """Lengths of the links [m], (3,)."""
        return 1e-3 * np.asarray(self.link_mm)

    @cached_property
    def rail(self) -> FloatArray:
        """Unit vectors d along the rails, (3, 3): one row for each leg."""
        alpha = np.radians(self.inclination_deg)
        # Of a right angle, cos is to be 0 and not 6e-17: vertical rails are parallel.
        along = np.where(np.abs(np.asarray(self.inclination_deg)) == 90.0, 0.0, np.cos(alpha))
        return np.asarray(along[:, None] * self.radial + np.sin(alpha)[:, None] * np.array([0.0, 0.0, 1.0]))

    @cached_property
    def joint_range(self) -> FloatArray:
        """Least and greatest permitted joint values [m], (2, 3)."""
        return 1e-3 * np.array([self.joint_lowest_mm, self.joint_highest_mm])

    def centre_m(self, q: FloatArray) -> FloatArray:
        """Return the (..., 3 legs, 3) joint centres [m] for (..., 3) joint values [m]."""
        return self.anchor_m + q[..., None] * self.rail


def _finite(values: FloatArray) -> FloatArray:
    if not np.isfinite(values).all():
        raise UsageError("A place or a joint value of the manipulator is not a finite number.")
    return values


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...i,...i", a, b))


def _root(product: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(product, 0.0))


def solve_inverse(delta: LinearDelta, p_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (..., 3) joint values [m] for places (..., 3) [m], and the length by which each link is too short [m].

    If a leg does not reach the place, its joint value is that of the stretched leg; never NaN.
    """
    w = _finite(p_m)[..., None, :] - delta.anchor_m
    along = _dot(w, delta.rail)
    beside = np.linalg.norm(w - along[..., None] * delta.rail, axis=-1)
    L = delta.link_m
    return along + _root((L - beside) * (L + beside)), beside - L


def forward(delta: LinearDelta, q: FloatArray) -> FloatArray:
    """Return the (..., 3) places [m] at joint values (..., 3) [m].

    Raises UsageError if a joint value is not finite, and ClosureError if the links do not meet (with measured joints, a
    lost step or a wrong geometry), or the joint centres lie in one line.
    """
    centre = delta.centre_m(_finite(q))
    L, c1 = delta.link_m, centre[..., 0, :]
    a, b = centre[..., 1, :] - c1, centre[..., 2, :] - c1
    n = np.cross(a, b)
    aa, bb, nn = _dot(a, a), _dot(b, b), _dot(n, n)
    if (nn <= 1e-24 * np.maximum(aa, bb) ** 2).any():
        raise ClosureError(f"The joint centres of {delta.title} lie in one line: the joint values determine no place.")
    along_a, along_b = 0.5 * (aa + (L[0] - L[1]) * (L[0] + L[1])), 0.5 * (bb + (L[0] - L[2]) * (L[0] + L[2]))
    to_a, to_b = np.cross(b, n) / nn[..., None], np.cross(n, a) / nn[..., None]
    x = along_a[..., None] * to_a + along_b[..., None] * to_b
    # Once more for what rounding left of x.a = A', x.b = B', x.n = 0: two centres near each other magnify it.
    x = x + (along_a - _dot(x, a))[..., None] * to_a + (along_b - _dot(x, b))[..., None] * to_b
    x = x - (_dot(x, n) / nn)[..., None] * n
    far = np.linalg.norm(x, axis=-1)
    if (far - L[0] > ROUNDING * L[0]).any():
        raise ClosureError(
            f"The links of {delta.title} do not meet at these joint values: {1e3 * float((far - L[0]).max()):.3g} mm "
            "are missing to the links' lengths.",
            hint="A step was lost or the geometry is wrong: home again, then check the geometry.",
        )
    height = MODE * _root((L[0] - far) * (L[0] + far))
    return np.asarray(c1 + x + (height / np.sqrt(nn))[..., None] * n)


class Measures(NamedTuple):
    """Distance from singularities at places (..., 3); see the module's table."""

    serial: FloatArray
    """Measure s of each leg, abs(u_i.d_i), (..., 3)."""
    parallel: FloatArray
    """Measure sigma_U, (...)."""
    constraint: FloatArray
    """Measure sigma_W, (...)."""
    sideways_rad: FloatArray
    """Angle of each link out of its leg's plane, asin abs(u_i.t_i) [rad], (..., 3)."""
    det: FloatArray
    """Determinant of U, (...); its sign is the assembly mode."""


def links(delta: LinearDelta, p_m: FloatArray, q: FloatArray) -> FloatArray:
    """Return the (..., 3 legs, 3) unit vectors u along the links, from joint to platform."""
    return np.asarray((p_m[..., None, :] - delta.centre_m(q)) / delta.link_m[:, None])


def measures(delta: LinearDelta, p_m: FloatArray, q: FloatArray) -> Measures:
    """Return the distances from singularities at places (..., 3) [m] with joint values (..., 3) [m]."""
    unit = links(delta, p_m, q)
    across = np.cross(delta.sideways, unit)
    return Measures(
        serial=np.abs(_dot(unit, delta.rail)),
        parallel=np.asarray(np.linalg.svd(unit, compute_uv=False)[..., -1]),
        constraint=np.asarray(np.linalg.svd(across, compute_uv=False)[..., -1]),
        sideways_rad=np.arcsin(np.minimum(np.abs(_dot(unit, delta.sideways)), 1.0)),
        det=np.linalg.det(unit),
    )


# Permitted moves ------------------------------------------------------------------------------------------------------


def margins(delta: LinearDelta, p_m: FloatArray) -> dict[str, FloatArray]:
    """Return by name of each limit the (n,) margins to it at (n, 3) places [m]; a negative margin exceeds the limit."""
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

    The beginning of the move is not checked: the platform is there already.
    """
    count = max(1, math.ceil(float(np.linalg.norm(end_m - start_m)) / SAMPLE_M))
    places = start_m + np.arange(1, count + 1)[:, None] / count * (end_m - start_m)
    for name, left in margins(delta, places).items():
        if (left < 0).any():
            place = ", ".join(f"{1e3 * x:.2f}" for x in places[np.argmax(left < 0)])
            raise PlaceRefusedError(
                f"The place ({place}) mm is not permitted: {name} would exceed its limit.",
                hint="Nothing has moved. Choose another place or another path.",
            )


def way(
    delta: LinearDelta, here_m: Place, xy_m: tuple[float, float], clearance_m: float, stand_off_m: float
) -> list[Place]:
    """Return the places [m] of a path: up to the clearance, sideways, then down to the stand-off above `xy_m`.

    Raises PlaceRefusedError if a move of the path is not permitted; nothing has moved.
    """
    top_m = max(here_m[2], clearance_m)
    places: list[Place] = [here_m, (*here_m[:2], top_m), (*xy_m, top_m), (*xy_m, stand_off_m)]
    for start, end in pairwise(places):
        check_move(delta, np.array(start), np.array(end))
    return places


def way_points(delta: LinearDelta, places: list[Place]) -> Iterator[list[float]]:
    """Yield the joint values [m] at the way points of a permitted path."""
    for start, end in pairwise(np.array(place) for place in places):
        pieces = math.ceil(float(np.linalg.norm(end - start)) / WAY_POINT_M)
        for n in range(1, pieces + 1):
            yield solve_inverse(delta, start + n / pieces * (end - start))[0].tolist()
