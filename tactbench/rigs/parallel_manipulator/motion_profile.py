"""A move along a way D from rest to rest, with limits v, a, j of speed, acceleration and jerk: the S-curve.

Derived. Ta = v/a + a/j if v j >= a^2, else 2 sqrt(v/j), is the time of getting up to v. If D >= v Ta the move lasts
D/v + Ta. Else it reaches v' only: if D >= 2 a^3/j^2, v' = (a/2)(sqrt((a/j)^2 + 4 D/a) - a/j) and it lasts
2 (v'/a + a/j); else v' = (D^2 j/4)^(1/3) and it lasts 4 (D/(2 j))^(1/3). With infinite jerk it is the trapezoid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator

from tactbench.plugin import Quantity, UsageError, assumed

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

_CHOICE = "gentle enough for a laboratory's machine; no source, the machine's maker decides"


class MotionLimits(BaseModel):
    """How fast the platform may move along its way."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    speed: Quantity = assumed(50.0, "mm/s", _CHOICE)
    """Largest speed [length / time]."""
    acceleration: Quantity = assumed(500.0, "mm/s/s", _CHOICE)
    """Largest acceleration [length / time^2]."""
    jerk: Quantity = assumed(5000.0, "mm/s/s/s", _CHOICE)
    """Largest change of acceleration [length / time^3]."""

    @model_validator(mode="after")
    def _positive(self) -> Self:
        rates = (self.speed.to("m/s"), self.acceleration.to("m/s/s"), self.jerk.to("m/s/s/s"))
        if not all(0 < rate < math.inf for rate in rates):
            raise ValueError("speed, acceleration and jerk are positive and finite")
        return self


@dataclass(frozen=True)
class MotionProfile:
    """A move of `distance_m` from rest to rest, `stretch` times as slow as its limits permit."""

    distance_m: float
    speed_m_s: float
    """Limit of speed."""
    acceleration_m_s2: float
    jerk_m_s3: float
    """May be infinite."""
    stretch: float = 1.0
    """At least 1: all of time is multiplied by it, so speeds fall by it and accelerations by its square."""

    def __post_init__(self) -> None:
        rates = (self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3)
        sound = 0 <= self.distance_m < math.inf and 1 <= self.stretch < math.inf
        if not (sound and all(rate > 0 for rate in rates) and math.inf not in rates[:2]):
            raise UsageError(
                f"A move over {self.distance_m} m with limits {rates}, {self.stretch} times as slow, cannot be made.",
                hint="Distances are 0 or more; limits are positive.",
            )

    @classmethod
    def of(cls, distance_m: float, limits: MotionLimits) -> MotionProfile:
        """Return the quickest move within stated limits."""
        rates = (limits.speed.to("m/s"), limits.acceleration.to("m/s/s"), limits.jerk.to("m/s/s/s"))
        return cls(distance_m, *rates)

    @cached_property
    def peak_m_s(self) -> float:
        """The speed it reaches, before it is stretched [m/s]."""
        D, v, a, j = self.distance_m, self.speed_m_s, self.acceleration_m_s2, self.jerk_m_s3
        if v * self._ramp_s(v) <= D:
            return v
        if 2 * a * (a / j) ** 2 <= D:
            return 0.5 * a * (math.sqrt((a / j) ** 2 + 4 * D / a) - a / j)
        return math.cbrt(D * D * j / 4)

    def _ramp_s(self, speed: float) -> float:
        """Return the time of getting from rest to a speed, before it is stretched."""
        a, j = self.acceleration_m_s2, self.jerk_m_s3
        return speed / a + a / j if speed * j >= a * a else 2 * math.sqrt(speed / j)

    @cached_property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        if self.distance_m == 0:
            return 0.0
        return self.stretch * (self.distance_m / self.peak_m_s + self._ramp_s(self.peak_m_s))

    @cached_property
    def _pieces(self) -> tuple[FloatArray, FloatArray]:
        """Times (8,) between seven pieces of constant jerk, and (4, 7) way, speed, acceleration and jerk there."""
        v, a, j = self.peak_m_s, self.acceleration_m_s2, self.jerk_m_s3
        rise = min(a / j, math.sqrt(v / j))  # time of rising acceleration
        most = a if rise == a / j else j * rise
        flat = max(v / most - rise, 0.0)  # time of constant acceleration
        cruise = max(self.distance_m / v - self._ramp_s(v), 0.0)
        lasting = np.array([rise, flat, rise, cruise, rise, flat, rise])
        slopes = np.array([1, 0, -1, 0, -1, 0, 1]) * (0.0 if math.isinf(j) else j)
        heights = np.array([0, most, most, 0, 0, -most, -most])
        state = np.zeros((4, 7))
        x = speed = 0.0
        for n, (time, acceleration, jerk) in enumerate(zip(lasting, heights, slopes, strict=True)):
            state[:, n] = x, speed, acceleration, jerk
            x += time * (speed + time * (acceleration / 2 + time * jerk / 6))
            speed += time * (acceleration + time * jerk / 2)
        return np.concatenate([[0.0], np.cumsum(lasting)]), state

    @property
    def corners_s(self) -> FloatArray:
        """The (8,) times between pieces of constant jerk [s]: where the acceleration may be greatest."""
        return self.stretch * self._pieces[0] if self.distance_m > 0 else np.zeros(8)

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return way [m], speed [m/s] and acceleration [m/s^2] at (n,) times; before and after it, it stands."""
        time = np.asarray(time_s, dtype=np.float64)
        if self.distance_m == 0:
            return np.zeros(time.shape), np.zeros(time.shape), np.zeros(time.shape)
        starts, state = self._pieces
        inside = np.clip(time / self.stretch, 0.0, starts[-1])
        piece = np.clip(np.searchsorted(starts, inside, side="right") - 1, 0, 6)
        dt = inside - starts[piece]
        x, v, a, j = state[:, piece]
        way = np.clip(x + dt * (v + dt * (a / 2 + dt * j / 6)), 0.0, self.distance_m)
        over, before = time >= self.duration_s, time <= 0
        speed = np.where(over | before, 0.0, np.maximum(v + dt * (a + dt * j / 2), 0.0))
        acceleration = np.where(over | before, 0.0, a + dt * j)
        way = np.where(over, self.distance_m, way)
        return way, speed / self.stretch, acceleration / self.stretch**2
