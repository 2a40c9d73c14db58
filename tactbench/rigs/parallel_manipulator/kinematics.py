"""Joint values of a place and the place of joint values, for both deltas, many at a time, without ever a NaN.

Inverse, closed form. Rails: w = p - A, s = d.w, n = |w - s d|, q = s + b sqrt((L - n)(L + n)). Arms: u = e.w, v = -w_z,
h = t.w, rho = hypot(u, v), m = sqrt((L - |h|)(L + |h|)), q = atan2(v, u) - 2 b atan2(sqrt N, sqrt D) with
N = (m - l_a + rho)(m + l_a - rho) and D = (l_a + rho - m)(l_a + rho + m).

Forward, three spheres. a = c2 - c1, b = c3 - c1, n = a x b, x = (A'(b x n) + B'(n x a))/|n|^2 with
A' = (|a|^2 + L1^2 - L2^2)/2 and B' = (|b|^2 + L1^2 - L3^2)/2, h = sqrt((L1 - |x|)(L1 + |x|)),
p = c1 + x + mode h n/|n|.

x is corrected once for what rounding left of x.a = A', x.b = B', x.n = 0, so that the links keep their lengths to
1.1e-15 of them also where two centres are near each other (without it 4e-14; measured over six million).

Both derived. Square roots are of products of sums and differences, cut at 0; a mask says where they were cut. `mode` is
kept from homing and not chosen by the lower z, which is the wrong solution at some permitted places of a rotary delta.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import RigError, UsageError
from tactbench.rigs.parallel_manipulator.geometry import Delta, LinearDelta

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

ROUNDING = 1e-12
"""Part of a link's length by which it may miss: distances of metres carry errors of a few 1e-16 of themselves, and
geometry files a few more; three digits are left over."""
LARGEST = 1e6
"""Largest coordinate [m] or joint value [m, rad]: fourth powers stay finite, and no machine is a thousandth of it."""


class UnreachableError(RigError):
    """A place that a leg does not reach.

    Attributes
    ----------
    leg
        Number of the leg, from 1.
    shortfall_m
        Length by which its link is too short, or too long [m].
    """

    leg: int | None = None
    shortfall_m: float | None = None


class NoClosureError(RigError):
    """Joint values at which the three links do not meet.

    Attributes
    ----------
    gap_m
        What the first link lacks [m].
    """

    gap_m: float | None = None


class SingularError(RigError):
    """Joint values that fix no place: the joint centres lie in one line."""


@dataclass(frozen=True)
class JointSolution:
    """What the inverse found for places (..., 3)."""

    q: FloatArray
    """(..., 3 legs) joint values, m or rad; where a leg does not reach, those of the stretched or folded leg."""
    shortfall_m: FloatArray
    """(..., 3 legs) length by which a link is too short or too long [m]; 0 or less: it reaches."""


@dataclass(frozen=True)
class PlaceSolution:
    """What the forward solution found for joint values (..., 3)."""

    p_m: FloatArray
    """(..., 3) places; where there is none, that of the nearest tangent spheres, or the first joint centre."""
    det: FloatArray
    """(...) determinant of the links' unit vectors: mode |n| h / (L1 L2 L3)."""
    gap_m: FloatArray
    """(...) what the first link lacks [m]; 0 or less: the links meet."""
    in_line: FloatArray
    """(...) 1 where the joint centres lie in one line or coincide, else 0."""


def _finite(values: FloatArray, what: str) -> FloatArray:
    found = np.asarray(values, dtype=np.float64)
    if found.shape[-1:] != (3,):
        raise UsageError(f"{what} has shape {found.shape}; expected (..., 3).")
    if not (np.abs(found) <= LARGEST).all():  # false for NaN
        raise UsageError(f"{what} is not a finite number of at most {LARGEST:g}.", hint="Lengths are metres here.")
    return found


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...i,...i", a, b))


def _root(product: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(product, 0.0))


def solve_inverse(delta: Delta, p_m: FloatArray) -> JointSolution:
    """Return joint values for places (..., 3) [m], and by how much each leg misses; raises UsageError if not finite."""
    w = _finite(p_m, "A place")[..., None, :] - delta.anchor_m
    L, b = delta.link_m, delta.branch
    if isinstance(delta, LinearDelta):
        along = _dot(w, delta.rail)
        beside = np.linalg.norm(w - along[..., None] * delta.rail, axis=-1)
        return JointSolution(along + b * _root((L - beside) * (L + beside)), beside - L)
    arm = delta.gear_m
    u, v, h = _dot(w, delta.radial), -w[..., 2], np.abs(_dot(w, delta.sideways))
    rho, m = np.hypot(u, v), _root((L - h) * (L + h))
    psi = 2 * np.arctan2(
        _root((m - (arm - rho)) * (m + (arm - rho))),
        _root((arm + rho - m) * (arm + rho + m)),
    )
    q = np.arctan2(v, u) - b * psi
    # One turn more or less is the same arm: the value nearest to horizontal.
    q = q - 2 * np.pi * np.round(q / (2 * np.pi))
    # Too far sideways, too far, or too near to the shaft.
    return JointSolution(q, np.maximum(np.maximum(h - L, rho - (arm + m)), np.abs(arm - m) - rho))


def inverse(delta: Delta, p_m: FloatArray) -> FloatArray:
    """Return the (..., 3) joint values, m or rad, of places (..., 3) [m].

    Raises
    ------
    UnreachableError
        With leg and shortfall, if any leg misses any place by more than `ROUNDING` of its link.
    UsageError
        If a place is not finite.
    """
    found = solve_inverse(delta, p_m)
    missing = found.shortfall_m - ROUNDING * delta.link_m
    if (missing > 0).any():
        where = np.unravel_index(int(np.argmax(missing)), missing.shape)
        leg, shortfall = int(where[-1]) + 1, float(found.shortfall_m[where])
        place = ", ".join(f"{1e3 * x:.3f}" for x in np.asarray(p_m)[where[:-1]])
        error = UnreachableError(
            f"Leg {leg} of {delta.title} misses the place ({place}) mm by {1e3 * shortfall:.3g} mm.",
            hint="Choose a place inside its workspace.",
        )
        error.leg, error.shortfall_m = leg, shortfall
        raise error
    return found.q


def solve_forward(delta: Delta, q: FloatArray, mode: int | None = None) -> PlaceSolution:
    """Return the place of joint values (..., 3); `mode` +-1, None: that of the geometry."""
    centre = delta.centre_m(_finite(q, "A joint value"))
    L = delta.link_m
    c1 = centre[..., 0, :]
    a, b = centre[..., 1, :] - c1, centre[..., 2, :] - c1
    n = np.cross(a, b)
    aa, bb, nn = _dot(a, a), _dot(b, b), _dot(n, n)
    longest = np.maximum(aa, bb)
    # Two centres in one place are in line with the third; three in one place are so to rounding only.
    in_line = (nn <= 1e-24 * longest**2) | (longest <= (ROUNDING * L[0]) ** 2)
    safe = np.where(in_line, 1.0, nn)
    along_a, along_b = 0.5 * (aa + (L[0] - L[1]) * (L[0] + L[1])), 0.5 * (bb + (L[0] - L[2]) * (L[0] + L[2]))
    to_a, to_b = np.cross(b, n) / safe[..., None], np.cross(n, a) / safe[..., None]
    x = along_a[..., None] * to_a + along_b[..., None] * to_b
    # Once more for what rounding left of x.a = A', x.b = B', x.n = 0: two centres near each other magnify it.
    x = x + (along_a - _dot(x, a))[..., None] * to_a + (along_b - _dot(x, b))[..., None] * to_b
    x = x - (_dot(x, n) / safe)[..., None] * n
    x = np.where(in_line[..., None], 0.0, x)
    far = np.linalg.norm(x, axis=-1)
    normal = np.sqrt(safe)
    height = (mode or delta.mode) * np.where(in_line, 0.0, _root((L[0] - far) * (L[0] + far)))
    p = c1 + x + (height / normal)[..., None] * n
    return PlaceSolution(
        p, normal * height / np.prod(L), np.where(in_line, 0.0, far - L[0]), in_line.astype(np.float64)
    )


def forward(delta: Delta, q: FloatArray, mode: int | None = None) -> FloatArray:
    """Return the (..., 3) places [m] of joint values (..., 3), m or rad.

    Raises
    ------
    NoClosureError
        If the links do not meet: with measured joints, a lost step or a wrong geometry.
    SingularError
        If the joint centres lie in one line.
    UsageError
        If a joint value is not finite.
    """
    found = solve_forward(delta, q, mode)
    if found.in_line.any():
        raise SingularError(
            f"The joint centres of {delta.title} lie in one line: its joints fix no place.",
            hint="Measure the joints again; no permitted move leads there.",
        )
    if (found.gap_m > ROUNDING * delta.link_m[0]).any():
        gap = float(found.gap_m.max())
        error = NoClosureError(
            f"The links of {delta.title} do not meet at these joint values: {1e3 * gap:.3g} mm are missing.",
            hint="A step was lost or the geometry is wrong: home again, then check the geometry.",
        )
        error.gap_m = gap
        raise error
    return found.p_m


def mode_of(delta: Delta, p_m: FloatArray, q: FloatArray) -> FloatArray:
    """Return +-1, or 0 at a parallel singularity, for places (..., 3) with joint values (..., 3)."""
    return np.asarray(np.sign(np.linalg.det(p_m[..., None, :] - delta.centre_m(q))))
