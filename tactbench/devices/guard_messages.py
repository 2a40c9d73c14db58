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
    """The guard does not arm."""


class GuardLostError(RigError):
    """The guard's process is gone or silent; the message states whether the pressing axis has retreated."""


class GuardState(StrEnum):
    """State of a guard."""

    IDLE = "idle"
    """Nothing may move."""
    ARMED = "armed"
    RETREATING = "retreating"
    RETREATED = "retreated"
    """After a retreat by command; all axes stand."""
    FAULT = "fault"
    """After a failure; all axes stand, or the event names the one that does not. Ended by `disarm`."""


class Trigger(StrEnum):
    """Reason of a retreat. All but the first two lead to :attr:`GuardState.FAULT`."""

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
    """Command of a beat."""

    NONE = "none"
    STEP = "step"
    """Move the pressing axis by `distance_m`, at most `Limits.step_m`: one increment at a time, each only after a force
    sample that was taken after the end of the one before."""
    MOVE_TO = "move to"
    """Move the pressing axis to `position_m` at `speed_m_s`: out of contact, or away from the skin. On the way into the
    skin the guard itself halts it when two of three force samples in a row are above `Limits.touch_n`."""
    TRAVEL = "travel"
    """Move other axes to `targets`, while the pressing axis stands at its place of retreat."""
    STOP = "stop"
    """Halt all axes."""
    RETREAT = "retreat"
    """Retreat, which ends in :attr:`GuardState.RETREATED`."""


@dataclass(frozen=True)
class Limits:
    """Limits of a guard, fixed from `arm` on.

    Raises
    ------
    UsageError
        If a number is not finite, or they contradict each other.
    """

    force_ceiling_n: float
    """Ceiling of the norm of the raw force, in one sample, while pressing."""
    travel_ceiling_n: float
    """Ceiling while any other axis moves, or any axis is homed or retracted."""
    touch_n: float
    """Raw pressing force that is a touch; below it the pressing axis is out of contact."""
    travel_m: tuple[float, float]
    """Least and greatest target of the pressing axis."""
    step_m: float
    """Longest increment: loop speed times control period."""
    speed_m_s: float
    """Largest speed of any move of the pressing axis."""
    heartbeat_s: float
    """T_dead, the largest age of a beat."""
    force_age_s: float
    """Largest age of a force sample."""
    channel: int
    """Index of the pressing channel in the force stream."""
    sign: int
    """-1: pressing makes that channel fall."""
    zero: tuple[float, ...]
    """Zero of every channel of the force stream, in its units; subtracted from raw samples."""
    confirmed: bool = False
    """Whether an operator has seen that the indenter is clear of the sensor; see :attr:`Report.unclear`."""
    clear_n: float = 0.1
    """Largest size of the mean pressing force with which the pressing axis, at its place of retreat, is clear of the
    sensor: above the noise of that mean (assumed)."""
    clear_s: float = 0.1
    """Time whose samples make that mean."""
    torque_ceiling_nm: float | None = None
    """Ceiling of the norm of the raw torque; None: torque is not checked."""
    same_samples: int = 50
    """Number of equal samples in a row that stand for a stuck sensor (assumed)."""
    lost_samples: int = 3
    """Most samples that may be missing between two (assumed)."""

    def pressing_n(self, data: FloatArray) -> FloatArray:
        """Return the (n,) raw pressing forces, less the zero, of (n, channels) samples of the force stream."""
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
                f"The guard's limits are not positive and finite, or contradict each other: {self}.",
                hint="See docs/hardware.md, Safety.",
            )


@dataclass(frozen=True)
class Beat:
    """Message of a rig once a control period: a sign of life, and a command."""

    t_ns: int = 0
    """Time at which it was made."""
    state: str = ""
    """State of the press, for the log."""
    command: CommandKind = CommandKind.NONE
    distance_m: float = 0.0
    """Length of a step, from `Report.target_m`; rounded to increments of the axis, so that the rig keeps remainders."""
    position_m: float = math.nan
    """Target of MOVE_TO."""
    speed_m_s: float = math.nan
    """Speed of MOVE_TO."""
    force_sequence: int = -1
    """`Report.force_sequence` of the sample that a step is based on."""
    targets: Mapping[str, float] = field(default_factory=dict)
    """Targets of TRAVEL, by axis."""


@dataclass(frozen=True)
class Report:
    """Answer of a guard."""

    t_ns: int
    state: GuardState
    reason: str = ""
    """Reason why the command is not carried out; empty: it is."""
    early: bool = False
    """Whether the command only came before its time: the move before has not ended, or no force sample was taken since.
    It may be sent again, and does not count as refused."""
    moving: bool = False
    """Whether any axis moves."""
    position_m: float = math.nan
    """Last position of the pressing axis."""
    target_m: float = math.nan
    positions: Mapping[str, float] = field(default_factory=dict)
    """Last position of each axis."""
    force_n: float = math.nan
    """Latest raw pressing force, less the zero."""
    force_sequence: int = -1
    """Number of that sample, by the count of its device or of the guard."""
    touched: bool = False
    """Whether the guard has ended the last MOVE_TO at a touch."""
    trigger: Trigger | None = None
    """Reason of the retreat."""
    not_out: str = ""
    """Instruction to an operator where an axis did not come out or does not stand; empty: none."""
    unclear: str = ""
    """Reason why an operator has to see that the indenter is clear before the guard arms; empty: none."""

    @property
    def accepted(self) -> bool:
        """Whether the command is carried out."""
        return not self.reason


@dataclass(frozen=True)
class Event:
    """Event for the log and the recording."""

    t_ns: int
    state: GuardState
    """State after it."""
    trigger: Trigger | None
    """None: an ordinary event, such as `armed`."""
    force_n: float
    position_m: float
    text: str
