"""What the integers of one drive mean: its units and largest arguments, as data.

No public document that was read states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no
motor: these are assumed, and a rig states its own.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict

from tactbench.plugin import Quantity, RigError, assumed, sourced

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

    def increments(self, position_m: float) -> int:
        """Return the nearest position argument.

        Raises
        ------
        RigError
            If the drive has no such position.
        """
        found = self._finite(position_m / self.position_unit.to("m"), "position", position_m, "m")
        return self._within(round(found), self.largest_position, "position", position_m, "m")

    def position_m(self, increments: float) -> float:
        """Return a position in metres."""
        return increments * self.position_unit.to("m")

    def speed(self, speed_m_s: float) -> int:
        """Return the argument of SP or V: the largest that is not faster than asked for; its sign is that of V.

        Raises
        ------
        RigError
            If the drive cannot be so fast, or not so slow.
        """
        return self._limit(speed_m_s, self.speed_unit.to("m/s"), self.largest_speed, "speed", "m/s")

    def speed_m_s(self, argument: float) -> float:
        """Return a speed in metres per second."""
        return argument * self.speed_unit.to("m/s")

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC, rounded down; raises RigError as `speed` does."""
        unit = self.acceleration_unit.to("m/s/s")
        return self._limit(acceleration_m_s2, unit, self.largest_acceleration, "acceleration", "m/s^2")

    def acceleration_m_s2(self, argument: float) -> float:
        """Return an acceleration in m/s^2."""
        return argument * self.acceleration_unit.to("m/s/s")

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC, rounded down; raises RigError as `speed` does."""
        return self._limit(current_a, self.current_unit.to("A"), self.largest_current, "current", "A")

    def current_a(self, argument: float) -> float:
        """Return a current in amperes."""
        return argument * self.current_unit.to("A")

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
