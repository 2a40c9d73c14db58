"""What passes between a rig and the guard of its axes.

Positions are m, those of the pressing axis positive into the skin; times are nanoseconds of the rig's clock.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from tactbench.core.errors import RigError, UsageError
from tactbench.core.samples import FloatArray


class GuardRefusesError(RigError):
    """The guard does not arm: something is not as it must be."""


class GuardLostError(RigError):
    """The guard's process is gone or silent; whether the pressing axis has retreated is in the message."""


class GuardState(StrEnum):
    """Where a guard is."""

    IDLE = "idle"
    """Nothing may move."""
    ARMED = "armed"
    RETREATING = "retreating"
    RETREATED = "retreated"
    """By command; all stand."""
    FAULT = "fault"
    """After something went wrong; all stand, or the event says which does not. Ended by `disarm`."""


class Trigger(StrEnum):
    """Why a guard retreated. All but the first two lead to :attr:`GuardState.FAULT`."""

    COMMANDED = "retreat commanded"
    TERMINATED = "SIGTERM"
    FORCE_CEILING = "force ceiling"
    TRAVEL_CEILING = "force while travelling or homing"
    TORQUE_CEILING = "torque ceiling"
    FORCE_NOT_A_NUMBER = "force is not a number"
    FORCE_FLAGGED = "force is flagged"
    FORCE_SATURATED = "force sensor is saturated"
    FORCE_GAP = "force samples lost"
    FORCE_OLD = "force too old"
    FORCE_STUCK = "force sensor gives the same value"
    FORCE_LOST = "force sensor is gone"
    BEAT_OLD = "no beat in time"
    RIG_LOST = "the rig's end of the pipe is closed"
    COMMANDS_REFUSED = "commands refused in a row"
    AXIS_FAULT = "axis fault"
    AXIS_SILENT = "axis does not answer"
    AXIS_LOST = "axis' link is gone"
    HOMING = "force or fault while homing"
    RETREAT_FAILED = "retreat failed"
    NOT_CLEAR = "not known to be clear of the sensor"
    GUARD_LOST = "guard is gone"


class CommandKind(StrEnum):
    """What a beat asks for."""

    NONE = "none"
    STEP = "step"
    """The pressing axis by `distance_m`, at most `Limits.step_m`: one increment at a time, each only after a force
    sample that was taken after the end of the one before."""
    MOVE_TO = "move to"
    """The pressing axis to `position_m` at `speed_m_s`: out of contact, or away from the skin. On the way into the skin
    the guard itself holds it when two of three force samples in a row are above `Limits.touch_n`."""
    TRAVEL = "travel"
    """Other axes to `targets`, while the pressing axis stands at its place of retreat."""
    STOP = "stop"
    """All axes hold the last measured position."""
    RETREAT = "retreat"
    """Ends in :attr:`GuardState.RETREATED`."""


@dataclass(frozen=True)
class Limits:
    """What a guard keeps, fixed from `arm` on.

    Raises
    ------
    UsageError
        If a number is not finite, or they contradict each other.
    """

    force_ceiling_n: float
    """Of the norm of the raw force, so of each axis of it, in one sample, while pressing."""
    travel_ceiling_n: float
    """The same while any other axis moves, or any axis is homed or retracted."""
    touch_n: float
    """Raw pressing force that is a touch; below it the pressing axis is out of contact."""
    travel_m: tuple[float, float]
    """Least and greatest target of the pressing axis."""
    step_m: float
    """Largest increment: loop speed times control period."""
    speed_m_s: float
    """Largest speed of any move of the pressing axis."""
    heartbeat_s: float
    """T_dead: the largest age of a beat."""
    force_age_s: float
    """The largest age of a force sample."""
    channel: int
    """Index of the pressing channel in the force stream."""
    sign: int
    """-1: pressing makes that channel fall."""
    zero: tuple[float, ...]
    """Of every channel of the force stream, in its units; subtracted from raw samples."""
    confirmed: bool = False
    """Whether an operator has seen that the indenter is clear of the sensor; see :attr:`Report.unclear`."""
    clear_n: float = 0.1
    """Largest size of the mean pressing force, of as many samples as come in `clear_s` after it stands at its place of
    retreat, with which the pressing axis is clear of the sensor: above the noise of that mean (assumed)."""
    clear_s: float = 0.1
    torque_ceiling_nm: float | None = None
    """Of the norm of the raw torque; None: torque is not looked at."""
    same_samples: int = 50
    """Samples in a row that are the same in all channels, after which the sensor is taken for stuck (assumed)."""
    lost_samples: int = 3
    """The most that may be missing between two (assumed)."""

    def pressing_n(self, data: FloatArray) -> FloatArray:
        """Return the (n,) raw pressing forces, less the zero, of (n, channels) samples of the force stream."""
        return np.asarray(self.sign * (data[:, self.channel] - self.zero[self.channel]))

    def __post_init__(self) -> None:
        positive = [
            self.force_ceiling_n, self.travel_ceiling_n, self.touch_n, self.step_m, self.speed_m_s, self.heartbeat_s,
            self.force_age_s, self.clear_n, self.clear_s,
            *([] if self.torque_ceiling_nm is None else [self.torque_ceiling_nm]),
        ]  # fmt: skip
        low, high = self.travel_m
        for wrong, problem in (
            (not all(0 < value < math.inf for value in positive), "a ceiling, step, speed or time is not positive"),
            (not -math.inf < low < high < math.inf, "the travel ends before it begins"),
            (not self.touch_n < self.force_ceiling_n, "the touch's force is not below the ceiling"),
            (self.travel_ceiling_n > self.force_ceiling_n, "the ceiling of travel is above that of pressing"),
            (not all(map(math.isfinite, self.zero)), "a zero is not finite"),
            (not 0 <= self.channel < len(self.zero), "the pressing channel has no zero"),
            (self.sign not in (-1, 1), "the sign is neither 1 nor -1"),
        ):
            if wrong:
                raise UsageError(f"The guard's limits are wrong: {problem}.", hint="See docs/hardware.md, Safety.")


@dataclass(frozen=True)
class Beat:
    """What a rig says once a control period: that it is there, and what shall be done."""

    t_ns: int = 0
    """When it was made."""
    state: str = ""
    """Of the press, for the log."""
    command: CommandKind = CommandKind.NONE
    distance_m: float = 0.0
    """Of a step, from `Report.target_m`; rounded to increments of the axis, so remainders must be kept by the rig."""
    position_m: float = math.nan
    """Of MOVE_TO."""
    speed_m_s: float = math.nan
    """Of MOVE_TO."""
    force_sequence: int = -1
    """`Report.force_sequence` of the sample that a step is based on."""
    targets: Mapping[str, float] = field(default_factory=dict)
    """Of TRAVEL, by axis."""


@dataclass(frozen=True)
class Report:
    """What a guard answers."""

    t_ns: int
    state: GuardState
    reason: str = ""
    """Why the command is not carried out; empty: it is."""
    early: bool = False
    """Whether a move only came before its time (the one before has not ended, or no force sample was taken since): that
    is no offence."""
    moving: bool = False
    """Whether any axis moves."""
    position_m: float = math.nan
    """Last read of the pressing axis."""
    target_m: float = math.nan
    positions: Mapping[str, float] = field(default_factory=dict)
    """Last read of each axis."""
    force_n: float = math.nan
    """Latest raw pressing force, less the zero."""
    force_sequence: int = -1
    """Number of that sample, as its device counts or the guard does."""
    touched: bool = False
    """Whether the guard has ended the last MOVE_TO because of a touch."""
    trigger: Trigger | None = None
    """Why it retreated."""
    not_out: str = ""
    """What is to be done, where something did not come out or stand still; empty: it did, or has not tried."""
    unclear: str = ""
    """Why an operator has to see that the indenter is clear of the sensor before the guard arms; empty: no need."""

    @property
    def accepted(self) -> bool:
        """Whether the command is carried out."""
        return not self.reason


@dataclass(frozen=True)
class Event:
    """Something that happened, for log and recording."""

    t_ns: int
    state: GuardState
    """Afterwards."""
    trigger: Trigger | None
    """None: an ordinary event, such as `armed`."""
    force_n: float
    position_m: float
    text: str
