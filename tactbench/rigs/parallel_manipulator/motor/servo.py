"""A linear motor under its drive's position control: a profile, followed with a lag, the largest force, end stops.

Quasi-static (assumed): the motor goes the first-order way of its lag towards the profile, as far as the load permits at
the current limit. Mass, friction and heat are left out; without power it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from pydantic import BaseModel, ConfigDict

from tactbench.plugin import Quantity, assumed

Load = Callable[[float, float], float]
"""Force on the motor [N], positive against positive motion, at a position [m] and a time [s]; no fall with position."""

_GUESS = "no document names the motor of the rig; of the order of small tubular linear motors"


class MotorModel(BaseModel):
    """The mechanics and the drive that the emulator stands for; a rig may state its own."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    force_constant: Quantity = assumed(6.5, "N/A", _GUESS)
    peak_current: Quantity = assumed(1.6, "A", _GUESS)
    """LPC at power-on."""
    continuous_current: Quantity = assumed(1.0, "A", _GUESS)
    """LCC at power-on; read back, and otherwise without effect."""
    travel: tuple[Quantity, Quantity] = (
        assumed(-10.0, "mm", "middle of 20 mm of travel"),
        assumed(10.0, "mm", "middle of 20 mm of travel"),
    )
    """Mechanical end stops, from the place at power-on."""
    lag: Quantity = assumed(5.0, "ms", "closed position loop of a small motor")
    tick: Quantity = assumed(1.0, "ms", "coarser than a real drive's, for speed; exact for every tick without a load")
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
        self.force_constant = model.force_constant.to("N/A")
        self.stops = (model.travel[0].to("m"), model.travel[1].to("m"))
        self._kept = math.exp(-self.tick_s / model.lag.to("s"))
        self.position_m = self.speed_m_s = self.current_a = 0.0
        self.limited = False
        """Whether the current stands at its limit."""

    def settled(self, reference: Profile) -> bool:
        """Whether the motor is at rest where the reference is, within what :meth:`step` resolves."""
        return abs(self.position_m - reference.position_m) <= REST_M and abs(self.speed_m_s) <= REST_M_S

    def step(self, time_s: float, reference: Profile | None, limit_a: float) -> None:
        """Go one tick, to `time_s`; `reference` None: the power stage is off, and it stands."""
        if reference is None:
            self.speed_m_s, self.current_a, self.limited = 0.0, 0.0, False
            return
        low, high = self.stops
        wish = reference.position_m + self._kept * (self.position_m - reference.position_m)
        moved = min(max(wish, low), high)
        self.limited = moved != wish
        force_n, most_n = self._force_n(moved, time_s), self.force_constant * limit_a
        if abs(force_n) > most_n:
            self.limited = True
            # Where the load is as large as the limit: further out for a load against positive motion.
            moved = self._balance(
                math.copysign(most_n, force_n), (low, moved) if force_n > 0 else (moved, high), time_s
            )
        if self.limited:
            force_n = math.copysign(most_n, reference.position_m - moved)
        self.speed_m_s = (moved - self.position_m) / self.tick_s
        self.position_m, self.current_a = moved, force_n / self.force_constant

    def _force_n(self, position_m: float, time_s: float) -> float:
        return 0.0 if self.load is None else self.load(position_m, time_s)

    def _balance(self, force_n: float, between_m: tuple[float, float], time_s: float) -> float:
        """Return the place between two at which the load, which does not fall with position, is a force."""
        low, high = between_m
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._force_n(middle, time_s) < force_n else (low, middle)
        return 0.5 * (low + high)
