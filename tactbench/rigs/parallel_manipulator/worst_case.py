"""The largest force there can be: at the first touch, and when the ceiling is exceeded.

All derived: the indenter goes on at its speed v until it is told to stop, then brakes with acceleration acc; the
stiffness k is the largest there is at that force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from tactbench.plugin import UsageError


@dataclass(frozen=True)
class Reaction:
    """What passes between a force and the motor's braking.

    The defaults are assumed, but for the scheduling, which is a measured 99.9th percentile of an ordinary kernel.
    """

    baud: float
    """Of the motor's line, 10 bits a byte."""
    force_age_s: float = 1e-3
    scheduling_s: float = 6e-3
    bytes_in_flight: int = 16
    """Of a command and its answers that must leave first."""
    stop_bytes: int = 3
    motor_lag_s: float = 10e-3

    @property
    def time_s(self) -> float:
        """All of it [s]."""
        line = 10 * (self.bytes_in_flight + self.stop_bytes) / self.baud
        return self.force_age_s + self.scheduling_s + line + self.motor_lag_s


def braking_force_n(stiffness_n_m: float, speed_m_s: float, acceleration_m_s2: float) -> float:
    """Return the force k v^2/(2 acc) [N] that the way of braking adds."""
    return stiffness_n_m * speed_m_s**2 / (2 * acceleration_m_s2)


def first_touch_n(
    threshold_n: float,
    stiffness_n_m: float,
    speed_m_s: float,
    acceleration_m_s2: float,
    period_s: float,
    delay_s: float,
    samples: int = 1,
) -> float:
    """Return the largest force [N] of a first touch, found by `samples` samples in a row above a threshold.

    F_t + k v (samples T + delay) + k v^2/(2 acc), for a threshold on the raw force and any phase of the samples.
    """
    waiting = samples * period_s + delay_s
    moving = stiffness_n_m * speed_m_s * waiting
    return threshold_n + moving + braking_force_n(stiffness_n_m, speed_m_s, acceleration_m_s2)


def approach_speed_m_s(
    allowed_n: float,
    threshold_n: float,
    stiffness_n_m: float,
    acceleration_m_s2: float,
    period_s: float,
    delay_s: float,
    samples: int = 1,
) -> float:
    """Return the largest speed [m/s] at which a first touch stays within `allowed_n`: the root of `first_touch_n`."""
    if not allowed_n > threshold_n:
        raise UsageError(
            f"A touch found at {threshold_n} N cannot stay within {allowed_n} N.", hint="Lower the threshold."
        )
    room = (allowed_n - threshold_n) / stiffness_n_m
    waiting = samples * period_s + delay_s
    # v^2/(2 acc) + v waiting = room, written so that nothing cancels.
    return 2 * room / (waiting + math.sqrt(waiting**2 + 2 * room / acceleration_m_s2))


def largest_force_n(
    ceiling_n: float, stiffness_n_m: float, speed_m_s: float, acceleration_m_s2: float, reaction: Reaction
) -> float:
    """Return F_max = F_c + k v t_r + k v^2/(2 acc) [N]; k is the largest stiffness at the ceiling."""
    moving = stiffness_n_m * speed_m_s * reaction.time_s
    return ceiling_n + moving + braking_force_n(stiffness_n_m, speed_m_s, acceleration_m_s2)


def check_largest_force(largest_n: float, rated_n: float, what: str) -> None:
    """Raise UsageError if a largest force exceeds what something is rated for [N]."""
    if not largest_n <= rated_n:  # also refuses what is not a number
        raise UsageError(
            f"The force may come to {largest_n:.2f} N; {what} is rated for {rated_n:.2f} N.",
            hint="Lower the speed, the ceiling or the approach's threshold, or quicken the line.",
        )
