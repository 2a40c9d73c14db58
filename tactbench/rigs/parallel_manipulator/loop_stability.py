"""Which gains of a force loop settle: eigenvalues of one step, the largest stable gain, and the loop on a spring.

The law is that of :mod:`force_law`; the motor goes a first-order way to targets d steps old, on a spring k:

    x_{n+1} = b x_n + (1 - b) c_{n-d}    b = exp(-T/lag),  d = delay/T rounded up

Only k kp and k ki count, so every limit is in proportion to 1/k. Without filter and lag the law of increments settles
for k ki T < 2 sin(pi/(2 (2 d + 1))) (derived): 2, 1, 0.618, 0.445 for d = 0 ... 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import ForceLoop, UsageError
from tactbench.rigs.parallel_manipulator.force_law import ForceController, ForceLaw

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray


@dataclass(frozen=True)
class LinearLoop:
    """A force loop without its limits, in m, N and s."""

    period_s: float
    proportional_m_n: float
    integral_m_n_s: float
    filter_kept: float
    """a; 0: unfiltered."""
    lag_kept: float
    """b; 0: no lag."""
    delay_periods: int

    @classmethod
    def of(cls, loop: ForceLoop) -> LinearLoop:
        """Return the loop of a drive whose rate is stated; raises UsageError if it is not."""
        if loop.rate is None:
            raise UsageError("The force loop's rate is not stated.", hint="State how often the motor is commanded.")
        period = 1 / loop.rate.to("Hz")
        lag = loop.motor_lag.to("s")
        return cls(
            period_s=period,
            proportional_m_n=loop.proportional.to("m/N"),
            integral_m_n_s=loop.integral.to("m/N/s"),
            filter_kept=0.0 if loop.cutoff is None else math.exp(-2 * math.pi * loop.cutoff.to("Hz") * period),
            lag_kept=math.exp(-period / lag) if lag > 0 else 0.0,
            # A delay of exactly so many periods does not become one more by rounding.
            delay_periods=math.ceil(loop.delay.to("s") / period - 1e-9),
        )

    def matrix(self, stiffness_n_m: FloatArray) -> FloatArray:
        """Return (..., m, m): what a step does to (x, y, i, c_{n-1} ... c_{n-d}) on springs (...) [N/m]."""
        k, d = np.asarray(stiffness_n_m, dtype=np.float64), self.delay_periods
        a, b = self.filter_kept, self.lag_kept
        step = np.zeros((*k.shape, 3 + d, 3 + d))
        step[..., 1, 0], step[..., 1, 1] = (1 - a) * k, a
        y = step[..., 1, :]
        integral = -self.integral_m_n_s * self.period_s * y
        integral[..., 2] += 1
        step[..., 2, :] = integral
        command = integral - self.proportional_m_n * y
        if d == 0:
            step[..., 0, :] = (1 - b) * command
        else:
            step[..., 3, :] = command
            for late in range(4, 3 + d):
                step[..., late, late - 1] = 1
            step[..., 0, 2 + d] = 1 - b
        step[..., 0, 0] += b
        return step

    def growth(self, stiffness_n_m: FloatArray) -> FloatArray:
        """Return (...) the largest modulus of the eigenvalues: the loop settles if it is below 1."""
        return np.asarray(np.abs(np.linalg.eigvals(self.matrix(stiffness_n_m))).max(axis=-1))

    def largest_stiffness_n_m(self) -> float:
        """Return the least stiffness [N/m] at which the loop no longer settles; infinity: up to a loop gain of 1000.

        Loop gains k (kp + ki T) from 1e-4 are looked at in steps of 2 %, then the crossing is halved to 1e-9 of itself.
        """
        per_stiffness = self.proportional_m_n + self.integral_m_n_s * self.period_s
        if not 0 < per_stiffness < math.inf:
            raise UsageError("A force loop without gains has no limit.")
        tried = np.geomspace(1e-4, 1e3, 815) / per_stiffness
        unstable = np.flatnonzero(self.growth(tried) >= 1)
        if not unstable.size:
            return math.inf
        if unstable[0] == 0:
            return float(tried[0])
        low, high = float(tried[unstable[0] - 1]), float(tried[unstable[0]])
        while high - low > 1e-9 * high:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.growth(np.array(middle)) < 1 else (low, middle)
        return high


def largest_gain_factor(loop: ForceLoop, stiffness_n_m: float) -> float:
    """Return by what both gains may be multiplied before the loop no longer settles at a stiffness [N/m]."""
    return LinearLoop.of(loop).largest_stiffness_n_m() / stiffness_n_m


def check_gains(loop: ForceLoop, stiffest_n_m: float) -> float:
    """Return the part of the largest stable gain that a loop uses at the stiffest place [N/m].

    Raises
    ------
    UsageError
        If it is more than half of it: an overshoot of a few per cent, and a cap stiffer than declared, need the rest.
    """
    used = 1 / largest_gain_factor(loop, stiffest_n_m)
    if used > 0.5:
        raise UsageError(
            f"The force loop's gains are {used:.2f} of those that no longer settle at {1e-3 * stiffest_n_m:g} N/mm; "
            "at most 0.5 is permitted.",
            hint=f"Divide both gains by {2 * used:.2f} or more.",
        )
    return used


def advised_integral_m_n_s(loop: ForceLoop, stiffness_n_m: float) -> float:
    """Return ki = 1/(2 k tau) [m/(N s)] of the law of increments, tau = filter's time + lag + d T + T/2.

    Derived for a slow loop; a step then overshoots by about 5 % (within 0.78 to 1.07 of that gain in twelve loops).
    """
    at = LinearLoop.of(loop)
    a = at.filter_kept
    filter_s = 0.0 if loop.cutoff is None else at.period_s * a / (1 - a)
    tau = filter_s + loop.motor_lag.to("s") + (at.delay_periods + 0.5) * at.period_s
    return 1 / (2 * stiffness_n_m * tau)


def ramp_error_n(loop: ForceLoop, slope_n_s: float, stiffness_n_m: float) -> float:
    """Return the steady force minus the wanted one [N] on a ramp without feed-forward, for ki > 0.

    r T a/(1 - a) - r/(k ki) (derived): the filter lets the true force run ahead, the integral lets it lag.
    """
    at = LinearLoop.of(loop)
    a = at.filter_kept
    return slope_n_s * (at.period_s * a / (1 - a) - 1 / (stiffness_n_m * at.integral_m_n_s))


def pressed_spring(
    law: ForceLaw,
    stiffness_n_m: float,
    setpoint_n: FloatArray,
    error_n: FloatArray,
    start_m: float = 0.0,
    slope_n_s: float = 0.0,
) -> FloatArray:
    """Return the (n,) depth [m] of a motor that presses a spring, which also pulls, by this law.

    Parameters
    ----------
    law
        With its limits.
    stiffness_n_m
        Of the spring [N/m].
    setpoint_n
        (n,) wanted force.
    error_n
        (n,) error of the force sensor; force is rounded to the loop's resolution.
    start_m
        Depth at the first step, at which everything has settled.
    slope_n_s
        Slope of the wanted force, for the feed-forward.
    """
    at, resolution = LinearLoop.of(law.loop), law.loop.resolution.to("N")
    x = start_m
    controller = ForceController(law, stiffness_n_m * x, x, 0.0)
    targets = [x] * (at.delay_periods + 1)
    depth = np.empty(setpoint_n.size)
    for n, (setpoint, error) in enumerate(zip(setpoint_n.tolist(), error_n.tolist(), strict=True)):
        depth[n] = x
        force = stiffness_n_m * x + error
        if resolution > 0:
            force = round(force / resolution) * resolution
        controller.step(force, x, (n + 1) * at.period_s, setpoint, slope_n_s)
        targets = [controller.target_m, *targets[:-1]]
        x = at.lag_kept * x + (1 - at.lag_kept) * targets[-1]
    return depth
