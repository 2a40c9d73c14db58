"""The force loop: a control law, a model of motor and skin, and a test of which gains are stable.

One step of length T, position positive into the skin, measured force m, filter y, integral i, command c:

    y_n = a y_{n-1} + (1 - a) m_n     a = exp(-2 pi f T)     e_n = setpoint_n - y_n
    i_n = i_{n-1} + ki T e_n + T r_n/k                       c_n = kp e_n + i_n
    x_{n+1} = b x_n + (1 - b) c_{n-d}                        b = exp(-T / lag),  d = delay/T rounded up

r is the slope of the wanted force and k the assumed stiffness: the feed-forward of a ramp. With kp = 0 it is the law of
increments c += ki T e; an admittance M x'' + D x' = e is ki = 1/D with a filter of time M/D. Filter and motor are
held-input solutions of their first-order laws, exact for every T. Derived.

Gains and positions are in one unit of length: m in rigs, mm in the twin.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from tactbench.core.errors import RigError, UsageError

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray
    from tactbench.core.spec.scene import ForceLoop

LATE = 1.5
"""Number of control periods after which a force sample counts as late."""


@dataclass(frozen=True)
class ForceLaw:
    """Numbers of the control law for the force: gains, filter and limits.

    Raises
    ------
    UsageError
        If a gain is negative, both are 0, or a limit is not positive.
    """

    period_s: float
    """Control period T [s]."""
    proportional: float
    """Proportional gain kp [length / N]."""
    integral: float
    """Integral gain ki [length / (N s)]."""
    cutoff_hz: float | None = None
    """Cut-off frequency f of the force filter [Hz]; None: unfiltered."""
    speed: float = math.inf
    """Largest speed of the command [length / s]."""
    windup_s: float = math.inf
    """Largest distance of command and measured position, as the time that a move at `speed` needs for it [s]."""
    travel: tuple[float, float] = (-math.inf, math.inf)
    """Least and greatest commanded position [length]."""
    feed_forward: float = math.inf
    """Stiffness k of the feed-forward [N / length]; infinite: no feed-forward."""

    def __post_init__(self) -> None:
        gains = (self.proportional, self.integral)
        positive = (self.period_s, self.speed, self.windup_s, self.feed_forward, self.cutoff_hz or 1.0, max(gains))
        if not (
            all(0 <= gain < math.inf for gain in gains)
            and all(value > 0 for value in positive)
            and self.travel[0] < self.travel[1]
        ):
            raise UsageError(f"A number of the force loop is not valid: {self}.", hint="Give gains and limits above 0.")

    def kept(self, passed_s: float) -> float:
        """Return a, the part (0 to 1) of its last value that the filter keeps after a time."""
        return 0.0 if self.cutoff_hz is None else math.exp(-2 * math.pi * self.cutoff_hz * passed_s)


class ForceController:
    """State of the control law during one press: filtered force, integral and command.

    Parameters
    ----------
    law
        Gains and limits of the control law.
    force_n, position
        Raw force [N] and measured position at the beginning, from which the command starts without a jump.

    Attributes
    ----------
    filtered_n
        The filtered force [N].
    target
        Position that was commanded last.
    """

    def __init__(self, law: ForceLaw, force_n: float, position: float) -> None:
        _check_known(force_n, position)
        self.law = law
        self.filtered_n, self.target = force_n, position
        self._integral = position

    def step(
        self, force_n: float, position: float, passed_s: float, setpoint_n: float, slope_n_s: float = 0.0
    ) -> float:
        """Return the next commanded position, positive into the skin.

        Limits apply in this order: speed of the command, its distance from the measured position, the travel. While
        a limit acts, the integral does not grow in its direction. At a late sample command and integral stay.

        Parameters
        ----------
        force_n, position
            Raw force [N], positive when pressing, and measured position.
        passed_s
            Time since the step before [s].
        setpoint_n, slope_n_s
            Wanted force [N], and its slope [N/s] for the feed-forward.

        Raises
        ------
        RigError
            If a number is not finite.
        UsageError
            If no time has passed.
        """
        _check_known(force_n, position, passed_s, setpoint_n, slope_n_s)
        if passed_s <= 0:
            raise UsageError(f"The time since the last step of the force loop is {passed_s} s; it must be above 0.")
        law = self.law
        kept = law.kept(passed_s)
        self.filtered_n = kept * self.filtered_n + (1 - kept) * force_n
        if passed_s > LATE * law.period_s:
            return self.target
        missing = setpoint_n - self.filtered_n
        growth = law.integral * passed_s * missing + passed_s * slope_n_s / law.feed_forward
        integral = self._integral + growth
        wish = law.proportional * missing + integral
        most, ahead = law.speed * passed_s, law.speed * law.windup_s
        target = min(max(wish, self.target - most), self.target + most)
        target = min(max(target, position - ahead), position + ahead)
        target = min(max(target, law.travel[0]), law.travel[1])
        if growth * (wish - target) <= 0:  # no limit acts against the growth
            self._integral = integral
        if law.proportional == 0:  # increments: the part that was cut is dropped
            self._integral = target
        self.target = target
        return target


def _check_known(*numbers: float) -> None:
    if not all(map(math.isfinite, numbers)):
        raise RigError(
            f"Force, position or time is not a finite number: {numbers}.",
            hint="Retreat: an unknown force counts as too large.",
        )


@dataclass(frozen=True)
class LoopModel:
    """Model of a motor that presses under a force law: simulation, and matrix of one step on a linear skin."""

    law: ForceLaw
    lag_kept: float
    """b, the part (0 to 1) of a commanded way that remains after one step; 0: no lag."""
    delay_steps: int
    speed: float = math.inf
    """Largest speed of the motor [length / s]; near its target the speed is limited by its braking."""
    acceleration: float = math.inf
    resolution_n: float = 0.0
    """Resolution of the measured force [N]; 0: not rounded."""

    @classmethod
    def of(cls, loop: ForceLoop, period_s: float, **limits: Any) -> Self:
        """Return the model of a force loop as declared in a scene or spec, with lengths in mm and a control period [s].

        `limits` may set `speed`, `windup_s`, `travel` and `feed_forward` of the control law.
        """
        law = ForceLaw(
            period_s=period_s,
            proportional=loop.proportional.to("mm/N"),
            integral=loop.integral.to("mm/N/s"),
            cutoff_hz=None if loop.cutoff is None else loop.cutoff.to("Hz"),
            **limits,
        )
        return cls.around(
            law,
            lag_s=loop.motor_lag.to("s"),
            delay_s=loop.delay.to("s"),
            speed=loop.speed.to("mm/s"),
            acceleration=loop.acceleration.to("mm/s/s"),
            resolution_n=loop.resolution.to("N"),
        )

    @classmethod
    def around(cls, law: ForceLaw, *, lag_s: float, delay_s: float, **motor: float) -> Self:
        """Return the model of a law with a motor's lag [s] and a command's delay [s]; `motor` sets other fields."""
        return cls(
            law,
            lag_kept=math.exp(-law.period_s / lag_s) if lag_s > 0 else 0.0,
            # A delay of exactly so many steps must not become one more by rounding.
            delay_steps=math.ceil(delay_s / law.period_s - 1e-9),
            **motor,
        )

    def matrix(self, stiffness: float) -> FloatArray:
        """Return the matrix of one step of (x, y, i, c_{n-1} ... c_{n-d}) on a linear skin, without limits or rounding.

        The loop is stable if and only if all eigenvalues of the matrix lie inside the unit circle.
        """
        law, kept = self.law, self.law.kept(self.law.period_s)
        x, y, integral, *late = np.eye(3 + self.delay_steps)  # each a row: by the state before the step
        y = kept * y + (1 - kept) * stiffness * x
        integral = integral - law.integral * law.period_s * y
        late = [integral - law.proportional * y, *late]
        x = self.lag_kept * x + (1 - self.lag_kept) * late[self.delay_steps]
        return np.array([x, y, integral, *late[: self.delay_steps]])

    def growth(self, stiffness: float) -> float:
        """Return the largest modulus of the eigenvalues at a stiffness [N / length]: above 1 the loop is unstable."""
        return float(np.abs(np.linalg.eigvals(self.matrix(stiffness))).max())

    def largest_stiffness(self) -> float:
        """Return the least stiffness [N / length] at which the loop is unstable; infinite: always stable.

        Loop gains k (kp + ki T) from 1e-4 to 1e3 are scanned in steps of 2 %. Only k kp and k ki count, so the largest
        stable gains at another stiffness are in inverse proportion.
        """
        from scipy.optimize import brentq

        law = self.law
        scanned = 1e-4 / (law.proportional + law.integral * law.period_s) * 1.02 ** np.arange(815)
        for softer, stiffer in pairwise(scanned.tolist()):
            if self.growth(stiffer) >= 1:
                return float(brentq(lambda stiffness: self.growth(stiffness) - 1, softer, stiffer, rtol=1e-6))
        return math.inf

    def simulate(
        self, force_n: Callable[[float], float], setpoint_n: FloatArray, noise_n: FloatArray, start: float = 0.0
    ) -> FloatArray:
        """Return the (n,) depths of the motor in the skin, one for each step [length].

        Parameters
        ----------
        force_n
            Function from a depth to the force of the skin [N].
        setpoint_n
            (n,) wanted force [N].
        noise_n
            (n,) errors of the force sensor [N].
        start
            Depth at the first step, with the loop at rest.
        """
        x, velocity, resolution = start, 0.0, self.resolution_n
        controller = ForceController(self.law, force_n(start), start)
        late = [start] * (self.delay_steps + 1)
        depths = np.empty(setpoint_n.size)
        for n, (setpoint, noise) in enumerate(zip(setpoint_n.tolist(), noise_n.tolist(), strict=True)):
            depths[n] = x
            measured = force_n(x) + noise
            if resolution > 0:
                measured = round(measured / resolution) * resolution
            late = [controller.step(measured, x, self.law.period_s, setpoint), *late[:-1]]
            velocity = self._velocity(late[-1] - x, velocity)
            x += velocity * self.law.period_s
        return depths

    def _velocity(self, way: float, velocity: float) -> float:
        """Return the motor's velocity in this step: as its lag gives, or less where a limit of the motor acts."""
        period_s = self.law.period_s
        wish = way * (1 - self.lag_kept) / period_s
        if math.isinf(self.acceleration):
            return min(max(wish, -self.speed), self.speed)
        # The speed from which steps of `most_change` still stop it within the way that is left: the root of
        # v^2 + v change - 2 acceleration way = 0, written so that nothing cancels.
        most_change = self.acceleration * period_s
        room = 2 * self.acceleration * abs(way)
        brake = room / (0.5 * most_change + math.sqrt(0.25 * most_change**2 + room)) if room > 0 else 0.0
        fastest = min(self.speed, brake)
        wish = min(max(wish, -fastest), fastest)
        return min(max(wish, velocity - most_change), velocity + most_change)
