"""What a rig file says of a motor on a Faulhaber drive, and what the drive's integers mean.

No public document that was read states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no
motor: the defaults are assumed, and a rig states its own.
"""

from __future__ import annotations

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from tactbench.plugin import RigError
from tactbench.plugin.devices import PositionerOptions
from tactbench.rigs.parallel_manipulator.motor.codec import BAUDS

LARGEST_POSITION, LARGEST_SPEED, LARGEST_ACCELERATION, LARGEST_CURRENT = 1_800_000_000, 10_000, 30_000, 12_000
"""Arguments of LA and LR; SP and V; AC and DEC; LPC and LCC (assumed)."""


class FaulhaberOptions(PositionerOptions):
    """What a rig file says of a motor and its drive; what it leaves out is as the drive has it."""

    node: int | None = Field(default=None, ge=1, le=255)
    """Address on a line with several drives."""
    baud: int = 9600
    """As in the link's address: time-outs go by it."""
    increment_m: float = Field(default=6e-6, gt=0.0)
    """Length of one increment (assumed: 3000 per 18 mm of magnet pitch, in no document read)."""
    speed_unit_m_s: float = Field(default=1e-3, gt=0.0)
    """One unit of SP, V, GN (assumed: by analogy with rpm of the rotary drives)."""
    acceleration_unit_m_s2: float = Field(default=1e-3, gt=0.0)
    """One unit of AC and DEC (assumed likewise)."""
    current_unit_a: float = Field(default=1e-3, gt=0.0)
    """One unit of LPC, LCC, GRC (sourced: Faulhaber manual MCBL 3564K024B CS, the rotary drive of the generation)."""
    lower_m: float | None = Field(default=None, lt=0.0)
    """The drive takes a negative and a positive end of travel."""
    upper_m: float | None = Field(default=None, gt=0.0)
    peak_current_a: float | None = Field(default=None, gt=0.0)
    continuous_current_a: float | None = Field(default=None, gt=0.0)
    force_constant_n_a: float | None = Field(default=None, gt=0.0)
    """Force per current: times the peak current it is the largest force."""
    homing: Literal["here", "switch", "end-stop"] = "here"
    """Where positions count from: the place at which it stands, the drive's reference switch, or an end stop that is
    run against."""
    homing_speed_m_s: float = 0.005
    """Negative: towards negative positions; of a switch without sign."""
    homing_current_a: float = Field(default=0.2, gt=0.0)
    """With which it runs against an end stop."""

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.baud not in BAUDS:
            raise ValueError(f"baud is one of {', '.join(map(str, BAUDS))}")
        if self.homing_speed_m_s == 0.0:
            raise ValueError("a homing speed is not 0")
        return self

    @property
    def largest_force_n(self) -> float | None:
        """Peak current times force constant [N]; None: one of them is not stated."""
        if self.peak_current_a is None or self.force_constant_n_a is None:
            return self.peak_force_n
        return self.peak_current_a * self.force_constant_n_a

    def homes_towards(self) -> int:
        """Return the sign of the homing speed against an end stop; 0: it stands, or the drive's set-up decides."""
        return int(math.copysign(1, self.homing_speed_m_s)) if self.homing == "end-stop" else 0

    # What the drive's integers mean -----------------------------------------------------------------------------------

    def increments(self, position_m: float) -> int:
        """Return the nearest position argument; raises RigError if the drive has no such position."""
        found = _finite(position_m / self.increment_m, "position", position_m, "m")
        return _within(round(found), LARGEST_POSITION, "position", position_m, "m")

    def position_m(self, increments: float) -> float:
        """Return a position in metres."""
        return increments * self.increment_m

    def speed(self, speed_m_s: float) -> int:
        """Return the argument of SP or V: the largest that is not faster than asked for; its sign is that of V.

        Raises
        ------
        RigError
            If the drive cannot be so fast, or not so slow.
        """
        return _limit(speed_m_s, self.speed_unit_m_s, LARGEST_SPEED, "speed", "m/s")

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC, rounded down; raises RigError as `speed` does."""
        return _limit(acceleration_m_s2, self.acceleration_unit_m_s2, LARGEST_ACCELERATION, "acceleration", "m/s^2")

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC, rounded down; raises RigError as `speed` does."""
        return _limit(current_a, self.current_unit_a, LARGEST_CURRENT, "current", "A")


def _limit(value: float, unit: float, largest: int, what: str, si: str) -> int:
    found = _finite(value / unit, what, value, si)
    # A quotient that is an integer but for rounding is that integer, not the one below.
    steps = math.floor(abs(found) * (1.0 + 4e-16))
    if steps == 0 and value != 0.0:
        raise RigError(
            f"A {what} of {value:g} {si} is below the drive's unit of {unit:g} {si}.",
            hint="Ask for more, or move in small steps of position.",
        )
    return _within(int(math.copysign(steps, value)), largest, what, value, si)


def _finite(found: float, what: str, value: float, si: str) -> float:
    if not math.isfinite(found):
        raise RigError(f"A {what} of {value:g} {si} is no number the drive can be sent.")
    return found


def _within(found: int, largest: int, what: str, value: float, si: str) -> int:
    if abs(found) > largest:
        raise RigError(f"A {what} of {value:g} {si} is {found} units; the drive takes at most {largest}.")
    return found
