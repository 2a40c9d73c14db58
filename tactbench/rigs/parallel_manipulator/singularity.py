"""How near a posture is to a singularity: three measures without units, 1 is best, and the sideways angle of the links.

| kind | when | measure |
|---|---|---|
| serial | a link perpendicular to its joint's way | least abs(s_i): a joint's speed is the platform's/s |
| parallel | links coplanar, or two joint centres coincide | sigma_U: the platform's error is the joints'/sigma_U |
| constraint | parallelograms flat, or all links in a plane with z | sigma_W: the platform can turn |

sigma_U is the smallest singular value of U, rows u_i; sigma_W that of W, rows t_i x u_i. Derived.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict, field_validator

from tactbench.plugin import Quantity, assumed
from tactbench.rigs.parallel_manipulator.geometry import Delta
from tactbench.rigs.parallel_manipulator.jacobian import links

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

_CHOICE = "a choice: errors and speeds grow to at most 1/0.15 = 7 times; no source"


class PostureLimits(BaseModel):
    """How near a singularity a machine may go."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    serial: Quantity = assumed(0.15, "1", _CHOICE)
    """Least abs(s_i) of any leg [1]."""
    parallel: Quantity = assumed(0.15, "1", _CHOICE)
    """Least sigma_U [1]."""
    constraint: Quantity = assumed(0.15, "1", _CHOICE)
    """Least sigma_W [1]."""
    sideways: Quantity = assumed(30.0, "deg", "rod ends of ordinary size; the machine's own joints decide")
    """Largest angle of a link out of its leg's plane [angle]."""

    @field_validator("serial", "parallel", "constraint")
    @classmethod
    def _between(cls, limit: Quantity) -> Quantity:
        if not 0.01 <= limit.to("1") < 1:
            raise ValueError("a limit of a singularity measure lies between 0.01 and 1")
        return limit

    @field_validator("sideways")
    @classmethod
    def _angle(cls, limit: Quantity) -> Quantity:
        if not 0 < limit.to("deg") < 90:
            raise ValueError("the sideways angle of a link lies between 0 and 90 deg")
        return limit


@dataclass(frozen=True)
class Measures:
    """The measures at places (..., 3)."""

    serial: FloatArray
    """(..., 3 legs) abs(s_i)."""
    parallel: FloatArray
    """(...) sigma_U."""
    constraint: FloatArray
    """(...) sigma_W."""
    sideways_rad: FloatArray
    """(..., 3 legs) asin abs(u_i.t_i)."""
    det: FloatArray
    """(...) det U; its sign is the assembly mode."""


def _least(rows: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.svd(rows, compute_uv=False)[..., -1], dtype=np.float64)


def measures(delta: Delta, p_m: FloatArray, q: FloatArray) -> Measures:
    """Return the measures at places (..., 3) [m] with their joint values (..., 3)."""
    at = links(delta, p_m, q)
    across = np.cross(delta.sideways, at.unit)
    out = np.abs(np.einsum("...ij,ij->...i", at.unit, delta.sideways))
    return Measures(
        serial=np.abs(at.projection),
        parallel=_least(at.unit),
        constraint=_least(across),
        sideways_rad=np.arcsin(np.minimum(out, 1.0)),
        det=np.linalg.det(at.unit),
    )


def place_error_m(delta: Delta, p_m: FloatArray, q: FloatArray, joint_error_m: float) -> FloatArray:
    """Return the (...) bound sqrt(3) max(s) e/sigma_U [m] on the platform's error.

    `joint_error_m` is the error e of each joint centre along its way [m]; of an arm, l_a times that of its angle.
    """
    found = measures(delta, p_m, q)
    return np.asarray(np.sqrt(3.0) * found.serial.max(axis=-1) * joint_error_m / found.parallel)
