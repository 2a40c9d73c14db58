"""Messages between a rig and the guard of its axes.

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
    """The guard refuses to be armed; the message states the reason."""


class GuardLostError(RigError):
    """The guard's process has ended or does not answer; the message states if the pressing axis has retreated."""


class GuardState(StrEnum):
    """State of the guard of a rig's axes."""

    IDLE = "idle"
    """Not armed: no axis may move."""
    ARMED = "armed"
    RETREATING = "retreating"
    RETREATED = "retreated"
    """After a commanded retreat; all axes are at rest."""
    FAULT = "fault"
    """After a failure; all axes are at rest, or the event names the axis that is not. Ended by `disarm`."""


class Trigger(StrEnum):
    """Reason of a retreat. All except the first two lead to :attr:`GuardState.FAULT`."""

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
    """Command to the guard, part of each beat."""

    NONE = "none"
    STEP = "step"
    """Move the pressing axis by `distance_m`, at most `Limits.step_m`: one increment at a time, each only after a
    force sample that was taken after the end of the increment before."""
    MOVE_TO = "move to"
    """Move the pressing axis to `position_m` at `speed_m_s`, out of contact, or away from the skin. On the way into the
    skin the guard itself halts it when two of three force samples in a row are above `Limits.touch_n`."""
    TRAVEL = "travel"
    """Move axes other than the pressing axis to `targets`, while the pressing axis is at its place of retreat."""
    STOP = "stop"
    """Halt all axes."""
    RETREAT = "retreat"
    """Retreat; this ends in :attr:`GuardState.RETREATED`."""


@dataclass(frozen=True)
class Limits:
    """Limits that a guard enforces, fixed when it is armed.

    Raises
    ------
    UsageError
        If a number is not finite, or numbers contradict each other.
    """

    force_ceiling_n: float
    """Norm of the raw force in a single sample at which the guard retreats while pressing [N]."""
    travel_ceiling_n: float
    """The same while another axis moves, or any axis is homed or retracted [N]."""
    touch_n: float
    """Raw pressing force above which there is contact with the skin [N]."""
    travel_m: tuple[float, float]
    """Least and greatest permitted target of the pressing axis [m]."""
    step_m: float
    """Longest increment [m]: speed of the force loop times control period."""
    speed_m_s: float
    """Largest permitted speed of the pressing axis [m/s]."""
    heartbeat_s: float
    """Largest permitted age of the last beat, T_dead [s]."""
    force_age_s: float
    """Largest permitted age of the newest force sample [s]."""
    channel: int
    """Index of the pressing channel in the force stream."""
    sign: int
    """1 if pressing makes the pressing channel rise, -1 if it makes the channel fall."""
    zero: tuple[float, ...]
    """Zero of every channel of the force stream, in its units; subtracted from raw samples."""
    confirmed: bool = False
    """True if an operator has confirmed that the indenter is clear of the sensor; see :attr:`Report.unclear`."""
    clear_n: float = 0.1
    """Largest absolute mean pressing force with which the pressing axis, at its place of retreat, is clear of the
    sensor [N]: above the noise of the mean (assumed)."""
    clear_s: float = 0.1
    """Time over which this mean is formed [s]."""
    torque_ceiling_nm: float | None = None
    """Norm of the raw torque at which the guard retreats [N*m]; None: not checked."""
    same_samples: int = 50
    """Number of equal samples in a row after which a force sensor counts as stuck (assumed)."""
    lost_samples: int = 3
    """Largest permitted number of samples that are missing in one reading of the force sensor (assumed)."""

    def pressing_n(self, data: FloatArray) -> FloatArray:
        """Return the (n,) raw pressing forces [N], less the zero, of (n, channels) samples of the force stream."""
        return np.asarray(self.sign * (data[:, self.channel] - self.zero[self.channel]))

    def __post_init__(self) -> None:
        positive = (
            self.force_ceiling_n, self.travel_ceiling_n, self.touch_n, self.step_m, self.speed_m_s, self.heartbeat_s,
            self.force_age_s, self.clear_n, self.clear_s,
            1.0 if self.torque_ceiling_nm is None else self.torque_ceiling_nm,
        )  # fmt: skip
        low, high = self.travel_m
        if not (
            all(0 < value < math.inf for value in positive)
            and -math.inf < low < high < math.inf
            and self.touch_n < self.force_ceiling_n >= self.travel_ceiling_n
            and all(map(math.isfinite, self.zero))
            and 0 <= self.channel < len(self.zero)
            and self.sign in (-1, 1)
        ):
            raise UsageError(
                f"Limits of the guard must be positive and finite, and must not contradict: {self}.",
                hint="See docs/hardware.md, Safety.",
            )


@dataclass(frozen=True)
class Beat:
    """Message of the rig to the guard in each control period: a sign of life, and a command."""

    t_ns: int = 0
    """Time at which the beat was made."""
    state: str = ""
    """State of the press, written to the log."""
    command: CommandKind = CommandKind.NONE
    distance_m: float = 0.0
    """Length of a STEP from `Report.target_m`; rounded to the axis' resolution, so the rig adds remainders later."""
    position_m: float = math.nan
    """Target position of MOVE_TO."""
    speed_m_s: float = math.nan
    """Speed of MOVE_TO [m/s]."""
    force_sequence: int = -1
    """`Report.force_sequence` of the force sample on which a step is based."""
    targets: Mapping[str, float] = field(default_factory=dict)
    """Targets of TRAVEL by axis name."""


@dataclass(frozen=True)
class Report:
    """Answer of the guard to a beat."""

    t_ns: int
    state: GuardState
    reason: str = ""
    """Reason why the command is not carried out; empty if it is carried out."""
    early: bool = False
    """True if the command only came too early: the last move has not ended, or no force sample was taken since. The
    command may be sent again, and does not count as refused."""
    moving: bool = False
    """True if any axis is moving."""
    position_m: float = math.nan
    """Last read position of the pressing axis."""
    target_m: float = math.nan
    positions: Mapping[str, float] = field(default_factory=dict)
    """Last read position of each axis, by name."""
    force_n: float = math.nan
    """Latest raw pressing force [N], less the zero."""
    force_sequence: int = -1
    """Number of force samples that the guard has received."""
    touched: bool = False
    """True if the guard has ended the last MOVE_TO at a touch."""
    trigger: Trigger | None = None
    """Reason of the last retreat; None: no retreat."""
    not_out: str = ""
    """Instruction to an operator if an axis has not retreated or is not at rest; empty: no instruction."""
    unclear: str = ""
    """Reason why an operator must confirm, before arming, that the indenter is clear; empty: no need."""

    @property
    def accepted(self) -> bool:
        """True if the command is carried out."""
        return not self.reason


@dataclass(frozen=True)
class Event:
    """One event of the guard, for its log and the recording."""

    t_ns: int
    state: GuardState
    """State of the guard after the event."""
    trigger: Trigger | None
    """Reason of a retreat; None: an ordinary event, such as `armed`."""
    force_n: float
    position_m: float
    text: str
