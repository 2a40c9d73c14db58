"""What passes between a rig and the guard of its linear motor.

The guard alone holds the links of motor and force sensor. A rig arms it with fixed limits, then sends a beat every
control period and gets a report; a beat that does not come in time, a force that is too large or not known, and
whatever is wrong with the motor make it retreat by itself. :class:`~.guard.LocalGuard` is a guard within the process,
for virtual time; :class:`~.guard_process.GuardProcess` speaks to one in a process of its own, for real devices.

Positions are the motor's, in metres, positive into the skin. Times are nanoseconds of the rig's clock. Everything here
goes over a pipe as JSON.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Protocol, Self

from tactbench.plugin import Block, RigError, StreamSpec, UsageError

RETREAT_S = 1.0
"""Added to the way's time, after which a retreat has failed (assumed)."""


class GuardRefusesError(RigError):
    """The guard does not arm: something is not as it must be."""


class GuardLostError(RigError):
    """The guard's process is gone or silent; whether the motor has retreated is in the message."""


class _Message:
    """A dataclass as one line of JSON; NaN stands for numbers that are not known."""

    def to_json(self) -> str:
        """Return one line of text."""
        return json.dumps(asdict(self))  # type: ignore[call-overload]

    @classmethod
    def from_json(cls, text: str | bytes) -> Self:
        """Return what :meth:`to_json` wrote; raises ValueError or TypeError for anything else."""
        found = json.loads(text)
        if not isinstance(found, dict):
            raise ValueError("no object")
        return cls(**found)


class GuardState(StrEnum):
    """What a guard does now."""

    IDLE = "idle"
    """Reads both devices and moves nothing; beats are neither expected nor obeyed."""
    ARMED = "armed"
    """Carries out beats, and watches."""
    RETREATING = "retreating"
    """On the way to `retreat_m`, whatever anybody says."""
    RETREATED = "retreated"
    """There, because it was told to; nothing moves before `disarm` and `arm`."""
    FAULT = "fault"
    """There, or standing as the event says, because of a trigger; nothing moves before `disarm` and `arm`."""


class Trigger(StrEnum):
    """Why a guard retreated. All but the first two lead to :attr:`GuardState.FAULT`."""

    COMMANDED = "retreat commanded"
    TERMINATED = "SIGTERM"
    FORCE_CEILING = "force ceiling"
    TORQUE_CEILING = "torque ceiling"
    FORCE_NOT_A_NUMBER = "force is not a number"
    FORCE_FLAGGED = "force is flagged"
    FORCE_SATURATED = "force sensor is saturated"
    FORCE_GAP = "force samples lost"
    FORCE_OLD = "force too old"
    FORCE_STUCK = "force sensor gives the same value"
    FORCE_LOST = "force sensor is gone"
    BEAT_OLD = "no beat in time"
    BEAT_SEQUENCE = "beat out of sequence"
    RIG_LOST = "the rig's end of the pipe is closed"
    COMMANDS_REFUSED = "commands refused in a row"
    CURRENT_LIMIT = "motor at its current limit"
    DEVIATION = "motor away from its reference"
    MOTOR_FAULT = "motor fault"
    MOTOR_SILENT = "motor does not answer"
    MOTOR_LOST = "motor's link is gone"
    HOMING = "force or fault while homing"
    RETREAT_FAILED = "retreat failed"
    GUARD_LOST = "guard is gone"
    INTERNAL = "error in the guard"


class CommandKind(StrEnum):
    """What a beat asks for."""

    NONE = "none"
    STEP = "step"
    """Move by `distance_m`, at most `Limits.step_m`: one increment at a time, each only after a force sample that was
    taken after the end of the one before."""
    MOVE_TO = "move to"
    """Move to `position_m` at `speed_m_s`: out of contact, or away from the skin. On the way into the skin the guard
    itself holds the motor when two of three force samples in a row are above `Limits.touch_n`."""
    STOP = "stop"
    """Hold the last measured position."""
    RETREAT = "retreat"
    """Retreat; ends in :attr:`GuardState.RETREATED`."""


@dataclass(frozen=True)
class Limits(_Message):
    """What a guard keeps, fixed from `arm` on. All of it is mandatory in a rig file, or computed from it.

    Raises
    ------
    UsageError
        If a number is not finite, or they contradict each other.
    """

    force_ceiling_n: float
    """Of the norm of the raw force, so of each axis, in one sample."""
    torque_ceiling_nm: float | None
    """Of the norm of the raw torque; None: torque is not looked at."""
    touch_n: float
    """Raw pressing force that is a touch; below it the motor is out of contact."""
    travel_m: tuple[float, float]
    """Least and greatest target."""
    step_m: float
    """Largest increment: loop speed times control period; rounded to increments of the drive, as each step is."""
    speed_m_s: float
    """Largest speed of any move."""
    retreat_m: float
    """Where the motor is away from the skin."""
    retreat_speed_m_s: float
    heartbeat_s: float
    """T_dead: the largest age of a beat."""
    force_age_s: float
    """The largest age of a force sample: three sampling periods and 10 ms."""
    channel: int
    """Index of the pressing channel in the force stream."""
    sign: int
    """-1: pressing makes that channel fall."""
    zero: tuple[float, ...]
    """Of every channel of the force stream, in its units; subtracted from raw samples."""
    homing_force_n: float = 0.2
    """Norm of the force above which homing is ended (assumed: well above noise and drift, well below a press)."""
    same_samples: int = 50
    """Samples in a row that are the same in all channels, after which the sensor is taken for stuck (assumed)."""
    lost_samples: int = 3
    """The most that may be missing between two (assumed)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "travel_m", tuple(self.travel_m))
        object.__setattr__(self, "zero", tuple(self.zero))
        numbers = [*self.travel_m, *self.zero, self.retreat_m]
        positive = [self.force_ceiling_n, self.touch_n, self.step_m, self.speed_m_s, self.retreat_speed_m_s]
        positive += [self.heartbeat_s, self.force_age_s, self.homing_force_n]
        positive += [] if self.torque_ceiling_nm is None else [self.torque_ceiling_nm]
        low, high = self.travel_m
        for wrong, problem in (
            (not all(map(math.isfinite, [*numbers, *positive])), "a number is not finite"),
            (not all(value > 0 for value in positive), "a ceiling, step, speed or time is not positive"),
            (not low < high, "the travel ends before it begins"),
            (not low <= self.retreat_m < high, "the place to retreat to is not within the travel, away from its end"),
            (not self.touch_n < self.force_ceiling_n, "the touch's force is not below the ceiling"),
            (not self.step_m <= high - low, "a step is longer than the travel"),
            (not 0 <= self.channel < len(self.zero), "the pressing channel has no zero"),
            (self.sign not in (-1, 1), "the sign is neither 1 nor -1"),
        ):
            if wrong:
                raise UsageError(f"The guard's limits are wrong: {problem}.", hint="See docs/hardware.md, Safety.")

    @property
    def retreat_s(self) -> float:
        """Within which a retreat from anywhere has ended."""
        low, high = self.travel_m
        return (high - low) / self.retreat_speed_m_s + RETREAT_S


@dataclass(frozen=True)
class Beat(_Message):
    """What a rig says once a control period: that it is there, and what shall be done."""

    sequence: int
    """One more than the one before; the first after `arm` is 1."""
    t_ns: int
    """When it was made."""
    state: str = ""
    """Of the press, for the log."""
    command: CommandKind = CommandKind.NONE
    distance_m: float = 0.0
    """Of a step, from `Report.target_m`; rounded to increments of the drive, so remainders must be kept by the rig."""
    position_m: float = math.nan
    """Of MOVE_TO."""
    speed_m_s: float = math.nan
    """Of MOVE_TO."""
    force_sequence: int = -1
    """`Report.force_sequence` of the sample that a step is based on."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "command", CommandKind(self.command))


@dataclass(frozen=True)
class Report(_Message):
    """What a guard answers."""

    sequence: int
    """Of the beat that it answers; 0: of `arm` and `disarm`."""
    t_ns: int
    state: GuardState
    accepted: bool
    """Whether the command is carried out. A step before its time (the one before has not ended, or no force sample was
    taken since) is not accepted either; that is no offence, and `early` is true."""
    reason: str = ""
    """Why not."""
    early: bool = False
    moving: bool = False
    position_m: float = math.nan
    """Last read of the motor, at `position_t_ns`."""
    position_t_ns: int = 0
    target_m: float = math.nan
    force_n: float = math.nan
    """Latest raw pressing force, less the zero."""
    force_sequence: int = -1
    """Number of that sample, as its device counts or the guard does."""
    force_t_ns: int = 0
    touched: bool = False
    """Whether the guard has ended the last MOVE_TO because of a touch."""
    trigger: Trigger | None = None
    """Why it retreated."""
    not_out: str = ""
    """What is to be done, where the motor did not come out; empty: it did, or has not tried."""
    event: str = ""
    """In words, what has happened since the last report."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "state", GuardState(self.state))
        object.__setattr__(self, "trigger", None if self.trigger is None else Trigger(self.trigger))


@dataclass(frozen=True)
class Event(_Message):
    """Something that happened, for log and recording."""

    t_ns: int
    state: GuardState
    """Afterwards."""
    trigger: Trigger | None
    """None: an ordinary event, such as `armed`."""
    force_n: float
    position_m: float
    text: str
    values: dict[str, float] = field(default_factory=dict)
    """Numbers beside force and position, with their unit in the name."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "state", GuardState(self.state))
        object.__setattr__(self, "trigger", None if self.trigger is None else Trigger(self.trigger))


class Guard(Protocol):
    """A guard; one thread uses it. A guard in another process may be lost: then all raise GuardLostError."""

    @property
    def force_stream(self) -> StreamSpec:
        """The force sensor's stream, from :meth:`start` on."""

    @property
    def motor_stream(self) -> StreamSpec:
        """The motor's stream, from :meth:`start` on."""

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Ask both devices who they are and let them sample; return what ``force`` and ``motor`` said.

        Force samples come from now on, so that a zero can be found before :meth:`arm`.

        Raises
        ------
        LinkError, RigError, UsageError
            As the drivers.
        """

    def arm(self, limits: Limits) -> Report:
        """Check everything, home the motor if it is not homed, and take it to `retreat_m`; beats count from then on.

        Armed already, with the motor at rest at `retreat_m`, it takes the new limits (another zero). The first beat is
        due within `heartbeat_s`, and its sequence is 1.

        Raises
        ------
        GuardRefusesError
            If something is not as it must be; nothing was moved, or what was begun has ended. The state is IDLE, or
            FAULT if force or motor went wrong while homing.
        """

    def beat(self, beat: Beat) -> Report:
        """Say that the rig is there, and what shall be done; return at once."""

    def advance(self, until_ns: int) -> None:
        """Let time pass until the rig's clock says so much; the rig's only wait while the guard is armed."""

    def force_blocks(self) -> list[Block]:
        """Return all force samples since the last call: raw, unfiltered, zero not subtracted, each once, in order."""

    def motor_blocks(self) -> list[Block]:
        """Return all samples of the motor since the last call."""

    def events(self) -> list[Event]:
        """Return what has happened since the last call."""

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Return what ``force``, ``motor`` and ``guard`` have counted."""

    def disarm(self) -> Report:
        """End ARMED, RETREATED or FAULT: the motor, if it is not there, retreats first, within its time."""

    def close(self) -> None:
        """Disarm, let both devices be and close their links; once closed, this does nothing."""
