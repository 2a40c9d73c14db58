"""A linear motor under its drive's position control: profile, controller, current limit, mass, load and end stops.

The drive steps at a fixed tick. In each tick

    m (v' - v) / h = clip(u', +-k_F i_max) - b v' - F(x'),    x' = x + h v'
    u' = k_p (r - x') + k_d (s - v') + z + h k_i (r - x')

with reference position r and speed s from a trapezoidal profile, and z the controller's integral. Backward Euler: every
term on the right falls with v' as long as the load F does not fall with x faster than m / h^2, so there is one root,
and the step is stable for every tick, stiffness and saturation. The gains put the three poles of the free motor at one
place w: k_p = 3 m w^2, k_d = 3 m w, k_i = m w^3 (derived).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from pydantic import BaseModel, ConfigDict

from tactbench.plugin import Quantity, assumed

Load = Callable[[float, float], float]
"""Force on the motor [N], positive against positive motion, at a position [m] and a time [s]; the same answer to the
same question, and no fall with position."""

_GUESS = "no document names the motor of the rig; of the order of small tubular linear motors"


class MotorModel(BaseModel):
    """The mechanics and the drive that the emulator stands for; a rig may state its own."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    mass: Quantity = assumed(0.1, "kg", _GUESS)
    """What moves: rod and indenter."""
    force_constant: Quantity = assumed(6.5, "N/A", _GUESS)
    damping: Quantity = assumed(0.5, "N*s/m", _GUESS)
    """Viscous friction."""
    peak_current: Quantity = assumed(1.6, "A", _GUESS)
    """LPC at power-on."""
    continuous_current: Quantity = assumed(1.0, "A", _GUESS)
    """LCC at power-on."""
    heating_time: Quantity = assumed(10.0, "s", "of the current's mean square, above which the limit falls to LCC")
    travel: tuple[Quantity, Quantity] = (
        assumed(-10.0, "mm", "middle of 20 mm of travel"),
        assumed(10.0, "mm", "middle of 20 mm of travel"),
    )
    """Mechanical end stops, from the place at power-on."""
    bandwidth: Quantity = assumed(300.0, "rad/s", "closed position loop; a lag of 10 ms")
    tick: Quantity = assumed(1.0, "ms", "coarser than a real drive's, for speed; the model is stable for every tick")
    answer_time: Quantity = assumed(1.0, "ms", "from the end of a command to the start of its answer; not documented")


REST_M, REST_M_S = 1e-9, 1e-8
"""A thousandth of an increment of 1 um, and ten times the resolution of the speed."""


class Profile:
    """The reference: a trapezoid of speed, recomputed every tick, that ends on its target."""

    def __init__(self, position_m: float) -> None:
        self.position_m = position_m
        self.speed_m_s = 0.0

    def stop_at(self, position_m: float) -> None:
        """Stand at a position at once: a motor without power, or one newly switched on."""
        self.position_m, self.speed_m_s = position_m, 0.0

    def to_position(self, target_m: float, tick_s: float, speed: float, acceleration: float, braking: float) -> None:
        """Go one tick towards a target [m]; speed [m/s], acceleration and braking [m/s^2], all positive."""
        if self.position_m == target_m and abs(self.speed_m_s) <= braking * tick_s * (1 + 1e-9):
            self.speed_m_s = 0.0
            return
        away = target_m - self.position_m
        commanded = math.copysign(min(speed, self.braking_speed(away, tick_s, braking)), away)
        self._go(commanded, tick_s, acceleration, braking)
        # The last tick ends within rounding of its target.
        if abs(target_m - self.position_m) < 1e-12 and abs(self.speed_m_s) <= braking * tick_s * (1 + 1e-9):
            self.position_m = target_m

    def to_speed(self, speed_m_s: float, tick_s: float, acceleration: float, braking: float) -> None:
        """Go one tick towards a speed [m/s]."""
        self._go(speed_m_s, tick_s, acceleration, braking)

    @staticmethod
    def braking_speed(away_m: float, tick_s: float, braking: float) -> float:
        """Return the speed of the next tick from which whole ticks of braking end on the target, `away_m` from here.

        n ticks of speed v, v - a h, …, v - (n - 1) a h cover h (n v - a h n (n - 1) / 2), n the least number of ticks
        that reaches (derived).
        """
        step = braking * tick_s
        n = max(1, math.ceil(math.sqrt(0.25 + 2.0 * abs(away_m) / (step * tick_s)) - 0.5))
        return abs(away_m) / (n * tick_s) + step * (n - 1) / 2.0

    def _go(self, commanded: float, tick_s: float, acceleration: float, braking: float) -> None:
        now = self.speed_m_s
        if now * commanded < 0.0:
            # Backwards goes through rest.
            commanded = 0.0
        largest = (acceleration if abs(commanded) > abs(now) else braking) * tick_s
        self.speed_m_s = now + min(max(commanded - now, -largest), largest)
        self.position_m += self.speed_m_s * tick_s


class Servo:
    """The motor's state and its step.

    Parameters
    ----------
    model
        The motor.
    load
        What it presses against; None: nothing, ever.
    """

    def __init__(self, model: MotorModel, load: Load | None) -> None:
        self.load = load
        self.tick_s = model.tick.to("s")
        self.mass = model.mass.to("kg")
        self.force_constant = model.force_constant.to("N/A")
        self.damping = model.damping.to("N*s/m")
        self.heating_s = model.heating_time.to("s")
        self.stops = (model.travel[0].to("m"), model.travel[1].to("m"))
        w = model.bandwidth.to("rad/s")
        self.gains = (3.0 * self.mass * w * w, 3.0 * self.mass * w, self.mass * w**3)
        self.position_m = 0.0
        self.speed_m_s = 0.0
        self.current_a = 0.0
        self.mean_square_a2 = 0.0
        """Of the current, over the heating time."""
        self.integral_n = 0.0
        self.limited = False
        """Whether the current stands at its limit."""

    def limit_a(self, peak_a: float, continuous_a: float) -> float:
        """Return the current that is allowed now: the peak, or the continuous one while the motor is warm."""
        return peak_a if self.mean_square_a2 < continuous_a**2 else min(peak_a, continuous_a)

    def settled(self, reference: Profile) -> bool:
        """Whether the motor is at rest where the reference is, within what :meth:`step` resolves."""
        return abs(self.position_m - reference.position_m) <= REST_M and abs(self.speed_m_s) <= REST_M_S

    def cool(self, ticks: int) -> None:
        """Let the mean square of a constant current go on by some ticks."""
        keep = math.exp(-ticks * self.tick_s / self.heating_s)
        self.mean_square_a2 = keep * self.mean_square_a2 + (1.0 - keep) * self.current_a**2

    def step(self, time_s: float, reference: Profile | None, limit_a: float) -> None:
        """Go one tick, to `time_s`; `reference` None: the power stage is off."""
        h, (kp, kd, ki) = self.tick_s, self.gains
        largest = self.force_constant * limit_a

        def force(v: float) -> float:
            if reference is None:
                return 0.0
            missing = reference.position_m - (self.position_m + h * v)
            commanded = kp * missing + kd * (reference.speed_m_s - v) + self.integral_n + h * ki * missing
            return min(max(commanded, -largest), largest)

        def residual(v: float) -> float:
            load = 0.0 if self.load is None else self.load(self.position_m + h * v, time_s)
            return self.mass * (v - self.speed_m_s) / h - force(v) + self.damping * v + load

        v = _root(residual, self.speed_m_s, self.mass / h)
        moved = self.position_m + h * v
        if not self.stops[0] <= moved <= self.stops[1]:
            moved = min(max(moved, self.stops[0]), self.stops[1])
            v = (moved - self.position_m) / h
        applied = force(v)
        if reference is None:
            self.integral_n, self.limited = 0.0, False
        else:
            missing = reference.position_m - moved
            self.limited = abs(applied) >= largest
            # Held while the limit acts in its direction, so that it does not wind up.
            if not (self.limited and missing * applied > 0.0):
                self.integral_n += h * ki * missing
        at_stop = moved in self.stops
        self.position_m, self.speed_m_s = moved, 0.0 if at_stop else v
        self.current_a = applied / self.force_constant
        self.cool(1)


def _root(residual: Callable[[float], float], guess: float, slope: float) -> float:
    """Return where `residual`, which rises at least by `slope`, is zero."""
    from scipy.optimize import brentq

    here = residual(guess)
    # The root is at most residual / slope away. 1 nm/s is a millionth of a micrometre per tick.
    if abs(here) <= 1e-9 * slope:
        return guess
    reach = -here / slope
    other = guess + reach
    # A load that falls with position may take the root a little further.
    for _ in range(60):
        if residual(other) * here <= 0.0:
            break
        reach *= 2.0
        other = guess + reach
    return float(brentq(residual, guess, other, xtol=1e-9, rtol=1e-12))
