"""One step of the force loop: from a measured force to the motor's next increment of position.

Of step length T, position positive into the skin, measured force m, filter y, integral i, target c:

    y_n = a y_{n-1} + (1 - a) m_n    a = exp(-2 pi f T)       e_n = setpoint_n - y_n
    i_n = i_{n-1} + ki T e_n + T r_n/k                        c_n = kp e_n + i_n

With kp = 0 it is the law of increments c += ki T e, and what a velocity in proportion to the missing force does; an
admittance M x'' + D x' = e is ki = 1/D with a filter of time M/D. r is the slope of the wanted force, k the assumed
stiffness of the skin: the feed-forward of a ramp. Derived; the same discrete law as the twin's. The filter takes the
time that has passed, so it is exact for steps of any length.

Three limits, in this order: c - c_{n-1} to the loop's speed, c to the measured position +- the way at that speed in
the wind-up time, c to the travel. While one of them acts, the integral does not grow in its direction. A late sample
moves and integrates nothing. Entering starts from the present force and position.
"""

from __future__ import annotations

import math
from typing import Self

from pydantic import BaseModel, ConfigDict, model_validator

from tactbench.plugin import ForceLoop, Quantity, RigError, UsageError, assumed

LATE = 1.5
"""Periods after which a sample is late: half a period more than it should be."""


class ForceLaw(BaseModel):
    """The force loop of a rig; gains, filter and rate are those of the scene's drive, so that twin and rig agree."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    loop: ForceLoop
    """Gains, cut-off of the filter, rate, delay and lag of the motor; the rate is stated."""
    speed: Quantity
    """Largest speed of the target [length / time]: 2 to 5 times what the ramp needs at the softest place."""
    windup_time: Quantity = assumed(0.1, "s", "some delays and lags of the motor; longer is more way to come back from")
    """Times `speed` is how far the target may be from the measured position [time]."""
    travel: tuple[Quantity, Quantity]
    """Least and greatest target [length]."""
    feed_forward: Quantity | None = None
    """Assumed stiffness of skin and machine in series [force / length]; None: no feed-forward."""

    @model_validator(mode="after")
    def _sound(self) -> Self:
        if self.loop.rate is None or not 0 < self.loop.rate.to("Hz") < math.inf:
            raise ValueError("the loop's rate is not stated")
        positive = {"speed": self.speed.to("m/s"), "windup_time": self.windup_time.to("s")}
        if self.feed_forward is not None:
            positive["feed_forward"] = self.feed_forward.to("N/m")
        for name, value in positive.items():
            if not 0 < value < math.inf:
                raise ValueError(f"{name} is not positive")
        if not self.travel[0].to("m") < self.travel[1].to("m"):
            raise ValueError("the travel ends before it begins")
        gains = (self.loop.proportional.to("m/N"), self.loop.integral.to("m/N/s"))
        if not all(0 <= gain < math.inf for gain in gains) or gains == (0.0, 0.0):
            raise ValueError("gains are 0 or more, and not both 0: a loop with a falling gain runs away")
        return self

    @property
    def period_s(self) -> float:
        """Time between two steps [s]."""
        assert self.loop.rate is not None  # validated
        return 1 / self.loop.rate.to("Hz")


class ForceController:
    """The loop's memory: filter, integral and target; one for each press.

    Parameters
    ----------
    law
        Gains and limits.
    force_n, position_m, now_s
        Raw force, measured position and time of entering.
    """

    def __init__(self, law: ForceLaw, force_n: float, position_m: float, now_s: float) -> None:
        self.law = law
        self._kp = law.loop.proportional.to("m/N")
        self._ki = law.loop.integral.to("m/N/s")
        cutoff = law.loop.cutoff
        self._rate = 0.0 if cutoff is None else 2 * math.pi * cutoff.to("Hz")
        self._speed = law.speed.to("m/s")
        self._ahead = self._speed * law.windup_time.to("s")
        self._low, self._high = (end.to("m") for end in law.travel)
        self._per_slope = 0.0 if law.feed_forward is None else 1 / law.feed_forward.to("N/m")
        self.filtered_n = force_n
        """The filtered force [N]."""
        self.target_m = position_m
        """The position commanded last [m]."""
        self.limited = False
        """Whether a limit acted in the last step."""
        self.late = False
        """Whether the last sample was late."""
        self._integral = position_m
        self._now = now_s
        self._known(force_n, position_m, now_s)

    def _known(self, *numbers: float) -> None:
        if not all(map(math.isfinite, numbers)):
            raise RigError(
                f"Force, position or time is not a number: {numbers}.",
                hint="An unknown force counts as too large a force: retreat.",
            )

    def step(self, force_n: float, position_m: float, now_s: float, setpoint_n: float, slope_n_s: float = 0.0) -> float:
        """Return the increment of the motor's target [m], positive into the skin.

        Parameters
        ----------
        force_n
            Raw force, positive when pressing [N].
        position_m
            Measured position of the motor [m].
        now_s
            Time of the sample [s].
        setpoint_n, slope_n_s
            Wanted force [N] and its slope [N/s], for the feed-forward.

        Raises
        ------
        RigError
            If a number is not finite.
        UsageError
            If time does not go forwards.
        """
        self._known(force_n, position_m, now_s, setpoint_n, slope_n_s)
        passed = now_s - self._now
        if passed <= 0:
            raise UsageError(f"The force loop was stepped at {now_s} s and at {self._now} s before.")
        self._now = now_s
        kept = math.exp(-self._rate * passed) if self._rate > 0 else 0.0
        self.filtered_n = kept * self.filtered_n + (1 - kept) * force_n
        self.late = passed > LATE * self.law.period_s
        if self.late:
            self.limited = False
            return 0.0
        missing = setpoint_n - self.filtered_n
        growth = self._ki * passed * missing + passed * slope_n_s * self._per_slope
        wish = self._kp * missing + self._integral + growth
        most = self._speed * passed
        target = min(max(wish, self.target_m - most), self.target_m + most)
        target = min(max(target, position_m - self._ahead), position_m + self._ahead)
        target = min(max(target, self._low), self._high)
        cut = wish - target
        self.limited = cut != 0
        if not (self.limited and growth * cut > 0):
            self._integral += growth
        if self._kp == 0:  # increments: what was cut is forgotten
            self._integral = target
        increment, self.target_m = target - self.target_m, target
        return increment
