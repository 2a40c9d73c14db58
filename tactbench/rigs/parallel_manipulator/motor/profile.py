"""Options of a motor on a Faulhaber drive in a rig file, and the units of the drive's integers.

No public document that was read states the units of the linear drives (MCLM 300x RS), and Karl et al. 2016 name no
motor: the defaults are assumed, and a rig states its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from pydantic import Field

from tactbench.plugin import RigError
from tactbench.plugin.devices import PositionerOptions

LARGEST_POSITION, LARGEST_SPEED, LARGEST_ACCELERATION, LARGEST_CURRENT = 1_800_000_000, 10_000, 30_000, 12_000
"""Arguments of LA; SP and V; AC and DEC; LPC and LCC (assumed)."""


class FaulhaberOptions(PositionerOptions):
    """Options of a motor and its drive; settings that are left out stay as the drive has them."""

    baud: int = Field(default=9600, gt=0)
    """As in the link's address: timeouts depend on it."""
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
    """Sent to the drive as its limit of peak current; see :attr:`current_limit_a`."""
    force_constant_n_a: float | None = Field(default=None, gt=0.0)
    """Force per current: times the limit of current it is the largest force."""
    homing: Literal["here", "end-stop"] = "here"
    """Origin of positions: the place at which it stands, or an end stop that it runs against."""
    homing_speed_m_s: float = 0.005
    """Towards the end stop; negative: towards negative positions."""
    homing_current_a: float = Field(default=0.2, gt=0.0)
    """Limit of current while it runs against an end stop."""

    @property
    def current_limit_a(self) -> float | None:
        """Limit of current that the drive is sent [A]: `peak_current_a`, or the current of `peak_force_n` if lower.

        None: neither is stated, or the force without its constant.
        """
        force_n, constant = self.peak_force_n, self.force_constant_n_a
        of_force = force_n / constant if force_n is not None and constant is not None else None
        return min((one for one in (self.peak_current_a, of_force) if one is not None), default=None)

    @property
    def largest_force_n(self) -> float | None:
        """Limit of current times force constant, or as declared where one of them is not stated [N]."""
        limit = self.current_limit_a
        return (
            self.peak_force_n if limit is None or self.force_constant_n_a is None else limit * self.force_constant_n_a
        )

    @property
    def force_source(self) -> str:
        """The source of :attr:`largest_force_n`."""
        if self.current_limit_a is None or self.largest_force_n is None:
            return super().force_source
        sent = f"sent current limit, {self.current_limit_a:g} A"
        return sent if self.force_constant_n_a else f"declared, with {sent}"

    def homes_towards(self) -> int:
        """Return the sign of the homing speed against an end stop; 0: it stands."""
        return int(math.copysign(1, self.homing_speed_m_s)) if self.homing == "end-stop" else 0

    # The drive's integers; each conversion raises RigError for a value that the drive does not take.

    def increments(self, position_m: float) -> int:
        """Return the nearest position argument."""
        return _whole(position_m, self.increment_m, LARGEST_POSITION, "position", round)

    def position_m(self, increments: float) -> float:
        """Return a position in metres."""
        return increments * self.increment_m

    def speed(self, speed_m_s: float) -> int:
        """Return the argument of SP or V: the largest that is not faster than asked for; its sign is that of V."""
        return _whole(speed_m_s, self.speed_unit_m_s, LARGEST_SPEED, "speed", _down)

    def acceleration(self, acceleration_m_s2: float) -> int:
        """Return the argument of AC or DEC, rounded down."""
        return _whole(acceleration_m_s2, self.acceleration_unit_m_s2, LARGEST_ACCELERATION, "acceleration", _down)

    def current(self, current_a: float) -> int:
        """Return the argument of LPC or LCC, rounded down."""
        return _whole(current_a, self.current_unit_a, LARGEST_CURRENT, "current", _down)


def _down(steps: float) -> int:
    # A quotient that is an integer but for rounding is that integer, not the one below.
    return int(steps * (1.0 + 4e-16))


def _whole(value: float, unit: float, largest: int, what: str, rounded: Callable[[float], int]) -> int:
    """Return a value in the drive's units; a value other than 0 becomes 0 only as the nearest position."""
    steps = rounded(value / unit) if math.isfinite(value) else largest + 1
    if abs(steps) > largest or (steps == 0 != value and rounded is _down):
        raise RigError(
            f"The drive has no {what} of {value:g}: its unit is {unit:g}, and it takes at most {largest} of them.",
            hint="Check the rig file, its units of the drive among them.",
        )
    return steps
