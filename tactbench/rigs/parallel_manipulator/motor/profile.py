"""Options of a motor on a Faulhaber drive in a rig file, and the units of the drive's integers.

No public document known here states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no motor:
the defaults are assumed, and a rig file has to state the units of its drive.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, Self

from pydantic import Field, model_validator

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
    """Value of one unit of LPC, LCC [A] (sourced: Faulhaber manual MCBL 3564K024B CS, the rotary drive)."""
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

    @model_validator(mode="after")
    def _sendable(self) -> Self:
        if self.peak_force_n is not None and self.force_constant_n_a is None:
            raise ValueError("peak_force_n needs force_constant_n_a: the drive takes a limit of current")
        return self

    @property
    def current_limit_a(self) -> float | None:
        """Current limit that is sent to the drive [A]: `peak_current_a`, or the current at `peak_force_n` if lower.

        None: neither option is stated.
        """
        limits_a = [] if self.peak_current_a is None else [self.peak_current_a]
        if self.peak_force_n is not None and self.force_constant_n_a is not None:
            limits_a.append(self.peak_force_n / self.force_constant_n_a)
        return min(limits_a, default=None)

    @property
    def largest_force_n(self) -> float | None:
        """Largest force [N]: current limit times force constant; None if one of both is not stated."""
        limit_a, constant = self.current_limit_a, self.force_constant_n_a
        return None if limit_a is None or constant is None else limit_a * constant

    @property
    def force_source(self) -> str:
        """Source of :attr:`largest_force_n`, for the tables of `doctor`."""
        return f"sent current limit, {self.current_limit_a:g} A" if self.largest_force_n else super().force_source

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
        return _whole(speed_m_s, self.speed_unit_m_s, LARGEST_SPEED, "speed")

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC for an acceleration [m/s^2], rounded down."""
        return _whole(acceleration_m_s2, self.acceleration_unit_m_s2, LARGEST_ACCELERATION, "acceleration")

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC for a current [A], rounded down."""
        return _whole(current_a, self.current_unit_a, LARGEST_CURRENT, "current")


def _whole(value: float, unit: float, largest: int, what: str, rounded: Callable[[float], int] | None = None) -> int:
    """Return a value in units of the drive, rounded down by default: then no value but 0 may become 0."""
    steps = value / unit if math.isfinite(value) else largest + 1
    # A quotient that is an integer but for rounding is that integer, not the one below.
    steps = int(steps * (1.0 + 4e-16)) if rounded is None else rounded(steps)
    if abs(steps) > largest or (steps == 0 != value and rounded is None):
        raise RigError(
            f"The drive cannot be set to a {what} of {value:g}: it takes steps of {unit:g}, {largest} at most.",
            hint="Check this value and the drive's units in the rig file.",
        )
    return steps
