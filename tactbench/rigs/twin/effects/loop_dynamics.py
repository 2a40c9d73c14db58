"""A discrete force loop around a motor that presses a skin: one step, and the matrix of its linearisation.

One step of length T, with depth x, measured force m, filter y, integral i, command c:

    m_n = round(F(x_n) + noise_n)          y_n = a y_{n-1} + (1 - a) m_n        a = exp(-2 pi f T)
    e_n = setpoint_n - y_n                   i_n = i_{n-1} + ki T e_n             c_n = kp e_n + i_n
    x_{n+1} = b x_n + (1 - b) c_{n-d}      b = exp(-T / lag)

Filter and motor are held-input solutions of their first-order laws: exact for any T, and neither can become unstable
by itself. The motor's speed and acceleration are limited, and so is its speed at a distance, to what it can brake.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, ForceLoop


@dataclass(frozen=True)
class Dynamics:
    """The numbers of one loop, in mm, N and s."""

    step_s: float
    proportional: float
    integral: float
    kept: float
    """`a`, what the filter keeps of its past in one step; 0: unfiltered."""
    left: float
    """`b`, how much of its way the motor has left after one step."""
    delay_steps: int
    speed: float
    acceleration: float
    resolution_n: float

    @classmethod
    def of(cls, drive: ForceLoop, step_s: float) -> Dynamics:
        """Return the loop of a declared drive, stepped every `step_s` seconds."""
        lag, cutoff = drive.motor_lag.to("s"), drive.cutoff
        return cls(
            step_s=step_s,
            proportional=drive.proportional.to("mm/N"),
            integral=drive.integral.to("mm/N/s"),
            kept=0.0 if cutoff is None else math.exp(-2 * math.pi * cutoff.to("Hz") * step_s),
            left=math.exp(-step_s / lag) if lag > 0 else 0.0,
            # A delay of exactly so many steps must not become one more by rounding.
            delay_steps=math.ceil(drive.delay.to("s") / step_s - 1e-9),
            speed=drive.speed.to("mm/s"),
            acceleration=drive.acceleration.to("mm/s/s"),
            resolution_n=drive.resolution.to("N"),
        )

    def matrix(self, stiffness_n_per_mm: float) -> FloatArray:
        """Return what one step does to (x, y, i, c_{n-1} ... c_{n-d}) on a linear skin, without limits and rounding.

        Its eigenvalues decide: the loop settles if and only if all lie inside the unit circle.
        """
        size = 3 + self.delay_steps
        columns = []
        for unit in np.eye(size):
            x, y, integral, *late = (float(value) for value in unit)
            y = self.kept * y + (1 - self.kept) * stiffness_n_per_mm * x
            integral -= self.integral * self.step_s * y
            late = [integral - self.proportional * y, *late]
            x = self.left * x + (1 - self.left) * late[self.delay_steps]
            columns.append([x, y, integral, *late[: self.delay_steps]])
        return np.array(columns).T

    def growth(self, stiffness_n_per_mm: float) -> float:
        """Return the largest modulus of the eigenvalues: above 1 the loop oscillates."""
        return float(np.abs(np.linalg.eigvals(self.matrix(stiffness_n_per_mm))).max())

    def limit_n_per_mm(self, most: float = 1e4) -> float:
        """Return the least stiffness at which the loop no longer settles; infinity if it does up to `most`.

        Softer skins are scanned in steps of 2 %, then the crossing is halved to 1e-6 of itself.
        """
        softer = 1e-3
        while self.growth(softer) < 1:
            stiffer = 1.02 * softer
            if stiffer > most:
                return math.inf
            if self.growth(stiffer) >= 1:
                while stiffer - softer > 1e-6 * softer:
                    middle = 0.5 * (softer + stiffer)
                    softer, stiffer = (middle, stiffer) if self.growth(middle) < 1 else (softer, middle)
                return stiffer
            softer = stiffer
        return softer

    def carried(
        self,
        force_n: Callable[[float], float],
        setpoint_n: FloatArray,
        noise_n: FloatArray,
        reach_mm: tuple[float, float],
        start_mm: float = 0.0,
    ) -> FloatArray:
        """Return the (n,) depth at each step, mm.

        Parameters
        ----------
        force_n
            Force of the skin at a depth; 0 above it.
        setpoint_n
            (n,) commanded force.
        noise_n
            (n,) error of the force sensor.
        reach_mm
            Depths between which the motor is commanded; the integral stops there, too.
        start_mm
            Depth at the first step, at which the loop has settled.
        """
        low, high = reach_mm
        x = integral = start_mm
        y = force_n(start_mm)
        late = [start_mm] * (self.delay_steps + 1)
        velocity, most_change = 0.0, self.acceleration * self.step_s
        depths = np.empty(setpoint_n.size)
        for n, (setpoint, noise) in enumerate(zip(setpoint_n.tolist(), noise_n.tolist(), strict=True)):
            depths[n] = x
            measured = force_n(x) + noise
            if self.resolution_n > 0:
                measured = round(measured / self.resolution_n) * self.resolution_n
            y = self.kept * y + (1 - self.kept) * measured
            missing = setpoint - y
            integral = min(max(integral + self.integral * self.step_s * missing, low), high)
            late = [min(max(self.proportional * missing + integral, low), high), *late[:-1]]
            velocity = self._velocity(late[-1] - x, velocity, most_change)
            x += velocity * self.step_s
        return depths

    def _velocity(self, way: float, velocity: float, most_change: float) -> float:
        """Return the velocity of this step: that of the lag, unless a limit of the motor holds it back."""
        # The speed from which steps of `most_change` still stop it within the way that is left: the root of
        # v^2 + v change - 2 acceleration way = 0, written so that nothing cancels.
        room = 2 * self.acceleration * abs(way)
        brake = room / (0.5 * most_change + math.sqrt(0.25 * most_change**2 + room)) if room > 0 else 0.0
        fastest = min(self.speed, brake)
        wish = min(max(way * (1 - self.left) / self.step_s, -fastest), fastest)
        return min(max(wish, velocity - most_change), velocity + most_change)
