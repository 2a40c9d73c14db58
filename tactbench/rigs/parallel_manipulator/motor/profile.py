"""What the integers of one drive mean: its units and largest arguments, as data.

No public document that was read states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no
motor: these are assumed, and a rig states its own.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from tactbench.plugin import Quantity, RigError, assumed, sourced
from tactbench.plugin.devices import PositionerOptions
from tactbench.rigs.parallel_manipulator.motor.codec import BAUDS

_MANUAL = "Faulhaber manual MCBL 3564K024B CS, the rotary drive of the same generation"


class MotorProfile(BaseModel):
    """What the integers of one drive mean: units, and the largest arguments.

    The defaults are those of no document; a rig states its own.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = "linear motor, Faulhaber ASCII"
    position_unit: Quantity = assumed(0.006, "mm", "3000 increments per 18 mm of magnet pitch, in no document read")
    """One increment of LA, LR, POS [length]."""
    speed_unit: Quantity = assumed(1.0, "mm/s", "by analogy with rpm of the rotary drives")
    """One unit of SP, V, GN [length / time]."""
    acceleration_unit: Quantity = assumed(1.0, "mm/s/s", "by analogy with the rotary drives")
    """One unit of AC and DEC [length / time^2]."""
    current_unit: Quantity = sourced(1.0, "mA", f"{_MANUAL}: LPC, LCC and GRC in mA")
    """One unit of LPC, LCC, GRC [current]."""
    largest_position: int = 1_800_000_000
    """Largest argument of LA and LR, increments (assumed)."""
    largest_speed: int = 10_000
    """Largest argument of SP and V (assumed)."""
    largest_acceleration: int = 30_000
    """Largest argument of AC and DEC (assumed)."""
    largest_current: int = 12_000
    """Largest argument of LPC and LCC (assumed)."""

    @cached_property
    def _position_m(self) -> float:
        return self.position_unit.to("m")

    @cached_property
    def _speed_m_s(self) -> float:
        return self.speed_unit.to("m/s")

    @cached_property
    def _acceleration_m_s2(self) -> float:
        return self.acceleration_unit.to("m/s/s")

    @cached_property
    def _current_a(self) -> float:
        return self.current_unit.to("A")

    def increments(self, position_m: float) -> int:
        """Return the nearest position argument.

        Raises
        ------
        RigError
            If the drive has no such position.
        """
        found = self._finite(position_m / self._position_m, "position", position_m, "m")
        return self._within(round(found), self.largest_position, "position", position_m, "m")

    def position_m(self, increments: float) -> float:
        """Return a position in metres."""
        return increments * self._position_m

    def speed(self, speed_m_s: float) -> int:
        """Return the argument of SP or V: the largest that is not faster than asked for; its sign is that of V.

        Raises
        ------
        RigError
            If the drive cannot be so fast, or not so slow.
        """
        return self._limit(speed_m_s, self._speed_m_s, self.largest_speed, "speed", "m/s")

    def speed_m_s(self, argument: float) -> float:
        """Return a speed in metres per second."""
        return argument * self._speed_m_s

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC, rounded down; raises RigError as `speed` does."""
        unit = self._acceleration_m_s2
        return self._limit(acceleration_m_s2, unit, self.largest_acceleration, "acceleration", "m/s^2")

    def acceleration_m_s2(self, argument: float) -> float:
        """Return an acceleration in m/s^2."""
        return argument * self._acceleration_m_s2

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC, rounded down; raises RigError as `speed` does."""
        return self._limit(current_a, self._current_a, self.largest_current, "current", "A")

    def current_a(self, argument: float) -> float:
        """Return a current in amperes."""
        return argument * self._current_a

    def _limit(self, value: float, unit: float, largest: int, what: str, si: str) -> int:
        found = self._finite(value / unit, what, value, si)
        # A quotient that is an integer but for rounding is that integer, not the one below.
        steps = math.floor(abs(found) * (1.0 + 4e-16))
        if steps == 0 and value != 0.0:
            raise RigError(
                f"A {what} of {value:g} {si} is below the drive's unit of {unit:g} {si}.",
                hint="Ask for more, or move in small steps of position.",
            )
        return self._within(int(math.copysign(steps, value)), largest, what, value, si)

    @staticmethod
    def _finite(found: float, what: str, value: float, si: str) -> float:
        if not math.isfinite(found):
            raise RigError(f"A {what} of {value:g} {si} is no number the drive can be sent.")
        return found

    @staticmethod
    def _within(found: int, largest: int, what: str, value: float, si: str) -> int:
        if abs(found) > largest:
            raise RigError(f"A {what} of {value:g} {si} is {found} units; the drive takes at most {largest}.")
        return found


class FaulhaberOptions(PositionerOptions):
    """What a rig file says of a motor and its drive; what it leaves out is as the drive has it."""

    node: int | None = Field(default=None, ge=1, le=255)
    """Address on a line with several drives."""
    baud: int = 9600
    """As in the link's address: time-outs go by it."""
    increment_m: float | None = Field(default=None, gt=0.0)
    """Length of one increment; this and the next three: as :class:`MotorProfile`, whose defaults are assumed."""
    speed_unit_m_s: float | None = Field(default=None, gt=0.0)
    acceleration_unit_m_s2: float | None = Field(default=None, gt=0.0)
    current_unit_a: float | None = Field(default=None, gt=0.0)
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

    def profile(self) -> MotorProfile:
        """Return the units."""
        stated = {
            "position_unit": (self.increment_m, "m"),
            "speed_unit": (self.speed_unit_m_s, "m/s"),
            "acceleration_unit": (self.acceleration_unit_m_s2, "m/s/s"),
            "current_unit": (self.current_unit_a, "A"),
        }
        return MotorProfile(
            **{
                name: sourced(value, unit, "the rig file")
                for name, (value, unit) in stated.items()
                if value is not None
            }
        )
