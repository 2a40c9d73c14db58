"""Speeds and accelerations of the joints, and the effort that holds a force: U p' = S q'.

With links l_i = p - c_i, u_i = l_i/L_i (rows of U), c' = g tau (g: way of the joint centre per unit of the joint, tau:
its direction), s_i = u_i.tau_i and S = diag(g_i s_i): differentiating |p - c(q)|^2 = L^2 once gives q' = u.p'/(g s),
and once more

    q'' = (|p' - g tau q'|^2/L + u.p'' + g^2 k q'^2 u.o)/(g s)

with curvature k of the joint centre's path (0 for a rail, 1/l_a for an arm) and o the direction away from its middle.
Derived. s_i changes sign where the inverse's branches meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactbench.rigs.parallel_manipulator.geometry import Delta, RotaryDelta

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray


@dataclass(frozen=True)
class Links:
    """The links at places (..., 3) with joint values (..., 3)."""

    unit: FloatArray
    """(..., 3 legs, 3) unit vectors u from joint centre to platform: the rows of U."""
    direction: FloatArray
    """(..., 3 legs, 3) unit vectors tau along which joint centres move."""
    projection: FloatArray
    """(..., 3 legs) s = u.tau, with its sign."""


def links(delta: Delta, p_m: FloatArray, q: FloatArray) -> Links:
    """Return the links at places (..., 3) [m] with the joint values (..., 3) of these places."""
    unit = (p_m[..., None, :] - delta.centre_m(q)) / delta.link_m[:, None]
    direction = delta.direction(q)
    return Links(unit, direction, np.einsum("...ij,...ij->...i", unit, direction))


def joint_motion(
    delta: Delta, p_m: FloatArray, q: FloatArray, velocity_m_s: FloatArray, acceleration_m_s2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the (..., 3) joint speeds and accelerations, m or rad, s, of a moving platform.

    Away from serial singularities only: s is divided by, and the caller has refused places where it is below its limit.

    Parameters
    ----------
    p_m, q
        (..., 3) places [m] and their joint values.
    velocity_m_s, acceleration_m_s2
        (..., 3) of the platform.
    """
    at, gear = links(delta, p_m, q), delta.gear_m
    rate = np.einsum("...ij,...j->...i", at.unit, velocity_m_s) / (gear * at.projection)
    swing = velocity_m_s[..., None, :] - (gear * rate)[..., None] * at.direction
    change = np.einsum("...ij,...ij->...i", swing, swing) / delta.link_m
    change = change + np.einsum("...ij,...j->...i", at.unit, acceleration_m_s2)
    if isinstance(delta, RotaryDelta):
        outwards = np.einsum("...ij,...ij->...i", at.unit, delta.outwards(q))
        change = change + (gear * rate) ** 2 * delta.bend_per_m * outwards
    return rate, change / (gear * at.projection)


def joint_effort(delta: Delta, p_m: FloatArray, q: FloatArray, force_n: FloatArray) -> FloatArray:
    """Return the (..., 3) efforts S U^-T F, N (rails) or N m (arms), that hold a force (..., 3) on the platform [N].

    Away from parallel singularities only: U is inverted.
    """
    at = links(delta, p_m, q)
    tension = np.linalg.solve(np.swapaxes(at.unit, -1, -2), force_n[..., None])[..., 0]
    return np.asarray(delta.gear_m * at.projection * tension)
