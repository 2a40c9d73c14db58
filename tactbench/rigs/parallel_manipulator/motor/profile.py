"""Options of a motor on a Faulhaber drive in a rig file, and the units of the drive's integers.

No public document known here states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no motor:
the defaults are assumed, and a rig file has to state the units of its drive.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from pydantic import Field

from tactbench.plugin import RigError
from tactbench.plugin.devices import PositionerOptions

LARGEST_POSITION, LARGEST_SPEED, LARGEST_ACCELERATION, LARGEST_CURRENT = 1_800_000_000, 10_000, 30_000, 12_000
"""Largest arguments of LA; SP and V; AC and DEC; LPC and LCC (assumed)."""


class FaulhaberOptions(PositionerOptions):
    """Options of a motor and its drive; settings left out remain as stored in the drive."""

    baud: int = Field(default=9600, gt=0)
    """Rate of the line [bit/s], as in the link's address; timeouts depend on it."""
    increment_m: float = Field(default=6e-6, gt=0.0)
    """Length of one increment [m] (assumed: 3000 per 18 mm of magnet pitch, in no document read)."""
    speed_unit_m_s: float = Field(default=1e-3, gt=0.0)
    """Value of one unit of SP, V, GN [m/s] (assumed: by analogy with rpm of the rotary drives)."""
    acceleration_unit_m_s2: float = Field(default=1e-3, gt=0.0)
    """Value of one unit of AC and DEC [m/s^2] (assumed likewise)."""
    current_unit_a: float = Field(default=1e-3, gt=0.0)
    """Value of one unit of LPC, LCC, GRC [A] (sourced: Faulhaber manual MCBL 3564K024B CS, the rotary drive)."""
    lower_m: float | None = Field(default=None, lt=0.0)
    """Ends of travel [m]; the drive needs a negative and a positive end."""
    upper_m: float | None = Field(default=None, gt=0.0)
    peak_current_a: float | None = Field(default=None, gt=0.0)
    """Limit of the peak current, sent to the drive [A]; see :attr:`current_limit_a`."""
    force_constant_n_a: float | None = Field(default=None, gt=0.0)
    """Force per current [N/A]; its product with the current limit is the largest force."""
    homing: Literal["here", "end-stop"] = "here"
    """Origin of positions: the motor's present place, or an end stop that it runs against."""
    homing_speed_m_s: float = 0.005
    """Speed towards the end stop [m/s]; negative: towards negative positions."""
    homing_current_a: float = Field(default=0.2, gt=0.0)
    """Limit of current while running against an end stop [A]."""

    @property
    def current_limit_a(self) -> float | None:
        """Current limit that is sent to the drive [A]: `peak_current_a`, or the current at `peak_force_n` if lower.

        None: neither option is stated, or `peak_force_n` without `force_constant_n_a`.
        """
        force_n, constant = self.peak_force_n, self.force_constant_n_a
        of_force = force_n / constant if force_n is not None and constant is not None else None
        return min((one for one in (self.peak_current_a, of_force) if one is not None), default=None)

    @property
    def largest_force_n(self) -> float | None:
        """Largest force [N]: current limit times force constant, or `peak_force_n` if one of both is not stated."""
        limit = self.current_limit_a
        return (
            self.peak_force_n if limit is None or self.force_constant_n_a is None else limit * self.force_constant_n_a
        )

    @property
    def force_source(self) -> str:
        """Source of :attr:`largest_force_n`, for the tables of `doctor`."""
        if self.current_limit_a is None or self.largest_force_n is None:
            return super().force_source
        sent = f"sent current limit, {self.current_limit_a:g} A"
        return sent if self.force_constant_n_a else f"declared, with {sent}"

    def homes_towards(self) -> int:
        """Return the sign of the homing speed towards an end stop; 0: homing without motion."""
        return int(math.copysign(1, self.homing_speed_m_s)) if self.homing == "end-stop" else 0

    # The drive's integers; each conversion raises RigError for a value that the drive does not take.

    def increments(self, position_m: float) -> int:
        """Return the argument of LA nearest to a position [m]."""
        return _whole(position_m, self.increment_m, LARGEST_POSITION, "position", round)

    def position_m(self, increments: float) -> float:
        """Return the position [m] of a number of increments."""
        return increments * self.increment_m

    def speed(self, speed_m_s: float) -> int:
        """Return the argument of SP or V for a speed [m/s], rounded towards 0; it keeps the sign."""
        return _whole(speed_m_s, self.speed_unit_m_s, LARGEST_SPEED, "speed", _down)

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC for an acceleration [m/s^2], rounded down."""
        return _whole(acceleration_m_s2, self.acceleration_unit_m_s2, LARGEST_ACCELERATION, "acceleration", _down)

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC for a current [A], rounded down."""
        return _whole(current_a, self.current_unit_a, LARGEST_CURRENT, "current", _down)


def _down(steps: float) -> int:
    # A quotient that is an integer but for rounding is that integer, not the one below.
    return int(steps * (1.0 + 4e-16))


def _whole(value: float, unit: float, largest: int, what: str, rounded: Callable[[float], int]) -> int:
    """Return a value in units of the drive; except for positions, a value other than 0 must not be rounded to 0."""
    steps = rounded(value / unit) if math.isfinite(value) else largest + 1
    if abs(steps) > largest or (steps == 0 != value and rounded is _down):
        raise RigError(
            f"The drive has no {what} of {value:g}: its unit is {unit:g}, its largest number {largest}.",
            hint="Check this value and the drive's units in the rig file.",
        )
    return steps
