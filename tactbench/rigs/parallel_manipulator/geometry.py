"""What a delta manipulator is made of, as data: lengths and angles of a file, and the same in SI for computing.

Leg i stands at azimuth phi_i, with e = (cos phi, sin phi, 0), t = (-sin phi, cos phi, 0), z up. Parallelograms keep the
platform parallel to its base, so the platform's radius is subtracted from the base's and each leg is one link of length
L from its joint centre to the point p of the platform (derived; the same folding in R. L. Williams II, The Delta
Parallel Robot: Kinematics Solutions, 2015):

    linear delta:  c(q) = A + q d,                     d = cos(alpha) e + sin(alpha) z
    rotary delta:  c(q) = A + l_a (cos q e - sin q z)  q from the horizontal, positive downwards
    both:          A = (R_b - r_p) e + offset,         |p - c_i(q_i)| = L_i

Files state mm and deg: this is the border where they become m and rad. Karl et al. 2016 name neither a mechanism nor a
geometry: that it is a delta is this project's assumption, and so is every number that is shipped.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from tactbench.plugin import Source

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray


_UP = np.array([0.0, 0.0, 1.0])


def _for_each_leg(value: Any) -> Any:
    return (value,) * 3 if isinstance(value, int | float) else value


Length = Annotated[FiniteFloat, Field(gt=0, le=1e5)]
PerLeg = Annotated[tuple[FiniteFloat, FiniteFloat, FiniteFloat], BeforeValidator(_for_each_leg)]
"""Three numbers, or one for all legs."""
PositivePerLeg = Annotated[tuple[Length, Length, Length], BeforeValidator(_for_each_leg)]


class _Delta(BaseModel, ABC):
    """What linear and rotary deltas have in common; joint values q are m (rails) or rad (arms)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    """Shown with what is computed from it; what is shipped is called an example."""
    source: Source
    """Where these numbers come from: `measured` on the machine, `sourced` from its drawings, or `assumed`."""
    azimuth_deg: PerLeg = (0.0, 120.0, 240.0)
    """Direction of each leg about z."""
    base_radius_mm: PositivePerLeg
    """From the axis to each joint's zero (rail) or shaft (arm)."""
    platform_radius_mm: PositivePerLeg
    """From the platform's axis to the joint of each link."""
    offset_mm: tuple[PerLeg, PerLeg, PerLeg] = ((0.0,) * 3,) * 3
    """Measured deviation of each leg's zero or shaft from its nominal place: x, y, z."""
    link_mm: PositivePerLeg
    """Length of each link between its joints; the forearm of a rotary delta."""
    branch: Literal[-1, 1] = 1
    """1: carriage ahead of the platform along its rail, or elbow outside; -1: the other solution of each leg."""
    mode: Literal[-1, 1] = -1
    """Sign of det(p - c1, p - c2, p - c3): which way the machine is assembled; kept along every permitted move."""

    @cached_property
    def radial(self) -> FloatArray:
        """The (3, 3) unit vectors e, a row per leg."""
        phi = np.radians(self.azimuth_deg)
        return np.stack([np.cos(phi), np.sin(phi), np.zeros(3)], axis=1)

    @cached_property
    def sideways(self) -> FloatArray:
        """The (3, 3) unit vectors t, a row per leg."""
        return np.stack([-self.radial[:, 1], self.radial[:, 0], np.zeros(3)], axis=1)

    @cached_property
    def anchor_m(self) -> FloatArray:
        """The (3, 3) folded zeros or shafts A [m], a row per leg."""
        folded = np.subtract(self.base_radius_mm, self.platform_radius_mm)
        return np.asarray(1e-3 * (folded[:, None] * self.radial + np.asarray(self.offset_mm)))

    @cached_property
    def link_m(self) -> FloatArray:
        """The (3,) lengths of the links [m]."""
        return 1e-3 * np.asarray(self.link_mm)

    @model_validator(mode="after")
    def _three_directions(self) -> Self:
        apart = np.abs(np.diff([*self.azimuth_deg, self.azimuth_deg[0] + 360.0]) % 360.0)
        if apart.min() < 1.0 or apart.max() > 359.0:
            raise ValueError("two legs stand at the same azimuth")
        return self

    @model_validator(mode="after")
    def _some_travel(self) -> Self:
        if (self.joint_range[0] >= self.joint_range[1]).any():
            raise ValueError("a joint's lowest value is not below its highest")
        return self

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a changed copy, which is checked again and computes its arrays anew."""
        return type(self).model_validate({**self.model_dump(), **(update or {})})

    @property
    @abstractmethod
    def joint_range(self) -> FloatArray:
        """The (2, 3) least and greatest permitted joint values."""


class LinearDelta(_Delta):
    """Three carriages on straight rails, vertical or inclined; q is the carriage's way along its rail from A [m]."""

    kind: Literal["linear-delta"] = "linear-delta"
    inclination_deg: PerLeg = (90.0, 90.0, 90.0)
    """Angle of each rail above the horizontal, outwards; 90: vertical."""
    joint_lowest_mm: PerLeg
    """Least permitted position of each carriage."""
    joint_highest_mm: PerLeg
    joint_speed_mm_s: PositivePerLeg
    """Largest speed of each carriage."""
    joint_acceleration_mm_s2: PositivePerLeg

    @cached_property
    def rail(self) -> FloatArray:
        """The (3, 3) unit vectors d along the rails, a row per leg."""
        alpha = np.radians(self.inclination_deg)
        # Of a right angle, cos is to be 0 and not 6e-17: vertical rails are parallel.
        along = np.where(np.abs(np.asarray(self.inclination_deg)) == 90.0, 0.0, np.cos(alpha))
        return np.asarray(along[:, None] * self.radial + np.sin(alpha)[:, None] * _UP)

    @cached_property
    def gear_m(self) -> FloatArray:
        """The (3,) way of a joint centre per unit of its joint: 1."""
        return np.ones(3)

    @cached_property
    def bend_per_m(self) -> FloatArray:
        """The (3,) curvature of the joint centres' paths [1/m]: 0, since rails are straight."""
        return np.zeros(3)

    @cached_property
    def joint_range(self) -> FloatArray:
        """The (2, 3) least and greatest permitted joint values [m]."""
        return 1e-3 * np.array([self.joint_lowest_mm, self.joint_highest_mm])

    @cached_property
    def joint_speed(self) -> FloatArray:
        """The (3,) largest joint speeds [m/s]."""
        return 1e-3 * np.asarray(self.joint_speed_mm_s)

    @cached_property
    def joint_acceleration(self) -> FloatArray:
        """The (3,) largest joint accelerations [m/s^2]."""
        return 1e-3 * np.asarray(self.joint_acceleration_mm_s2)

    def centre_m(self, q: FloatArray) -> FloatArray:
        """Return the (..., 3 legs, 3) joint centres [m] of (..., 3) joint values."""
        return self.anchor_m + q[..., None] * self.rail

    def direction(self, q: FloatArray) -> FloatArray:
        """Return the (..., 3 legs, 3) unit vectors along which joint centres move with growing q."""
        return np.broadcast_to(self.rail, (*q.shape, 3))


class RotaryDelta(_Delta):
    """Three arms on shafts; q is the angle of each arm below the horizontal [rad]."""

    kind: Literal["rotary-delta"] = "rotary-delta"
    arm_mm: PositivePerLeg
    """From each shaft to the elbow."""
    joint_lowest_deg: PerLeg
    """Least permitted angle of each arm."""
    joint_highest_deg: PerLeg
    joint_speed_deg_s: PositivePerLeg
    """Largest angular speed of each arm."""
    joint_acceleration_deg_s2: PositivePerLeg

    @cached_property
    def gear_m(self) -> FloatArray:
        """The (3,) way of a joint centre per radian: the lengths of the arms [m]."""
        return 1e-3 * np.asarray(self.arm_mm)

    @cached_property
    def bend_per_m(self) -> FloatArray:
        """The (3,) curvature of the elbows' circles [1/m]."""
        return np.asarray(1.0 / self.gear_m)

    @cached_property
    def joint_range(self) -> FloatArray:
        """The (2, 3) least and greatest permitted joint values [rad]."""
        return np.radians([self.joint_lowest_deg, self.joint_highest_deg])

    @cached_property
    def joint_speed(self) -> FloatArray:
        """The (3,) largest joint speeds [rad/s]."""
        return np.radians(self.joint_speed_deg_s)

    @cached_property
    def joint_acceleration(self) -> FloatArray:
        """The (3,) largest joint accelerations [rad/s^2]."""
        return np.radians(self.joint_acceleration_deg_s2)

    def outwards(self, q: FloatArray) -> FloatArray:
        """Return the (..., 3 legs, 3) unit vectors from shaft to elbow."""
        return np.asarray(np.cos(q)[..., None] * self.radial - np.sin(q)[..., None] * _UP)

    def centre_m(self, q: FloatArray) -> FloatArray:
        """Return the (..., 3 legs, 3) elbows [m] of (..., 3) joint values."""
        return self.anchor_m + self.gear_m[:, None] * self.outwards(q)

    def direction(self, q: FloatArray) -> FloatArray:
        """Return the (..., 3 legs, 3) unit vectors along which elbows move with growing q."""
        return np.asarray(-np.sin(q)[..., None] * self.radial - np.cos(q)[..., None] * _UP)


Delta = LinearDelta | RotaryDelta
Geometry = Annotated[Delta, Field(discriminator="kind")]
"""For a field of a rig's settings: which of the two it is, is said by `kind`."""


_EXAMPLE = Source(tag="assumed", reference="an example to try the software with; no machine was measured")


def example_linear() -> LinearDelta:
    """Return an example with vertical rails: nobody's machine, and not the paper's, which is not known."""
    return LinearDelta(
        title="example of a linear delta",
        source=_EXAMPLE,
        base_radius_mm=150.0,
        platform_radius_mm=30.0,
        link_mm=250.0,
        joint_lowest_mm=-50.0,
        joint_highest_mm=250.0,
        joint_speed_mm_s=200.0,
        joint_acceleration_mm_s2=2000.0,
    )


def example_rotary() -> RotaryDelta:
    """Return an example with arms: nobody's machine, and not the paper's, which is not known."""
    return RotaryDelta(
        title="example of a rotary delta",
        source=_EXAMPLE,
        base_radius_mm=90.0,
        platform_radius_mm=30.0,
        link_mm=220.0,
        arm_mm=100.0,
        joint_lowest_deg=-45.0,
        joint_highest_deg=85.0,
        joint_speed_deg_s=90.0,
        joint_acceleration_deg_s2=900.0,
    )
