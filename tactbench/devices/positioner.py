"""Base class of drivers for devices that move along or about one axis: linear motors, a manipulator's rails, stages."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from tactbench.core.errors import LinkTimeout, RigError
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tactbench.devices.driver import Driver, DriverSettings, Options
from tactbench.links.address import read_options
from tactbench.links.link import ByteLink, Link

SILENT_S = 0.5
"""Timeout for an answer of a controller [s] (assumed)."""
SETTLE_S = 0.5
"""Time added to the computed duration of a move, after which the move has failed [s] (assumed)."""
HOMING_S = 60.0
"""Timeout for homing [s] (assumed)."""
HALTS = 2
"""Number of halt commands before :meth:`Positioner.halt_harder` is called (assumed)."""
FASTER = 1.5
"""Largest plausible ratio of an axis' apparent to its stated speed; a larger one means lost steps (assumed)."""


class PositionerError(RigError):
    """An axis or its controller has not carried out a command."""


class PositionerSilentError(PositionerError):
    """The controller does not answer; it may or may not have carried out the last command."""


class NotReadyError(PositionerError):
    """A move is not permitted at present, or never is; no command was sent."""


@dataclass(frozen=True)
class PositionerFacts:
    """Stated properties of an axis; positions in m (or rad), those of a pressing axis positive into the skin."""

    limits: tuple[float, float]
    """Least and greatest position, also enforced by the controller; NaN: not stated, and the axis is never moved."""
    resolution: float
    """Smallest step [m or rad]."""
    corridor: float
    """Largest distance from its target at which a move may end [m or rad]."""
    speed: float
    """Largest speed of a move [m/s or rad/s]."""
    acceleration: float
    """Acceleration of braking [m/s^2 or rad/s^2]."""
    stop_latency_s: float
    """Longest time from the call of :meth:`Positioner.halt` or :meth:`~Positioner.retreat` until braking begins."""
    interruptible: bool
    """True if `halt` and `retreat` end a move under way; False if the controller completes every move."""
    holds_unpowered: bool
    """True if the axis keeps its place unpowered: horizontal, or with brake, counterweight or self-locking screw."""
    homes_here: bool = False
    """True if homing takes the present place as home, even if the indenter is in the skin."""
    retreat: float = math.nan
    """Position away from the skin to which the axis retreats [m or rad]; NaN: a retreat is only a halt."""
    retreat_speed: float = math.nan

    @property
    def near(self) -> float:
        """Largest distance from a place at which the axis counts as being there [m or rad]."""
        return max(self.corridor, 2.0 * self.resolution)

    def seconds(self, distance: float, speed: float) -> float:
        """Return the longest time that a move may take [s]."""
        return abs(distance) / speed + 2.0 * speed / self.acceleration + SETTLE_S


@dataclass(frozen=True)
class PositionerState:
    """State of an axis as reported by its controller."""

    t_ns: int
    """Time at which the position was received, on the host's clock."""
    position: float
    target: float = math.nan
    """Commanded position; NaN: not known."""
    problem: str = ""
    """Reported condition that must end a press, such as current limit or deviation; empty: no such condition."""


class PositionerOptions(Options):
    """Options of any axis in a rig file; a subclass adds the options of its controller."""

    lower_m: float | None = None
    """Ends of travel, enforced by controller and driver; without both the axis can be read, but not moved."""
    upper_m: float | None = None
    home_m: float = 0.0
    """Position given to the place that homing finds [m]."""
    speed_m_s: float | None = Field(default=None, gt=0.0)
    """Speed of moves [m/s]."""
    acceleration_m_s2: float | None = Field(default=None, gt=0.0)
    """Acceleration at the start and at the end of a move [m/s^2]."""
    corridor_m: float | None = Field(default=None, gt=0.0)
    """Distance from its target within which a move has ended [m]: well below the shortest move."""
    retreat_m: float | None = None
    """Position away from the sensor, for a retreat [m]."""
    retreat_speed_m_s: float | None = Field(default=None, gt=0.0)
    orientation: Literal["horizontal", "vertical"] | None = None
    """Direction of the axis; needed before a press, for a vertical axis together with `brake` and `counterweight`."""
    brake: bool | None = None
    """True if a brake holds the axis without power."""
    counterweight: bool | None = None
    """True if a counterweight or spring holds the axis without power."""
    peak_force_n: float | None = Field(default=None, gt=0.0)
    """Largest force that the axis' drive can exert [N]: the only bound left if the force sensor reads wrong values."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        low, high = self.lower_m, self.upper_m
        if (low is None) != (high is None):
            raise ValueError("give both lower_m and upper_m, or neither")
        if low is not None and high is not None:
            if not low < high:
                raise ValueError("lower_m must be below upper_m")
            if self.retreat_m is not None and not low <= self.retreat_m <= high:
                raise ValueError("retreat_m must be between lower_m and upper_m")
        return self

    @property
    def largest_force_n(self) -> float | None:
        """Largest force that the drive can exert [N]; None: not stated."""
        return self.peak_force_n

    @property
    def force_source(self) -> str:
        """Source of :attr:`largest_force_n`; a subclass whose driver sends a limit to its controller overrides it."""
        return "unknown" if self.largest_force_n is None else "declared"

    @property
    def holds_unpowered(self) -> bool:
        """True if the axis keeps its place without power; False if this is not known."""
        return self.orientation == "horizontal" or bool(self.brake) or bool(self.counterweight)

    def homes_towards(self) -> int:
        """Return the sign of the direction in which homing moves; 0: no motion, or the direction is not known."""
        return 0


class Positioner(Driver):
    """Base class of the driver of one axis.

    Only :meth:`home` and the moves move the axis, and only :meth:`enable` and :meth:`home` give it power.
    :meth:`home`, :meth:`enable` and :meth:`disable` return at their end, within a bound. :meth:`move_to`,
    :meth:`move_by`, :meth:`halt` and :meth:`retreat` return at once; :meth:`update` is called until :attr:`moving` is
    false. While a move is under way, `halt` and `retreat` replace it; all other moves are refused.

    The call that detects a failure raises PositionerSilentError, another PositionerError, or a LinkError.

    As a device of a rig an axis has one stream, `motor`: position and target, one row for each state read.
    A subclass defines abstract methods and class attributes. It calls :meth:`check_move` before it sends a move,
    :meth:`begin` after, and :meth:`see` with each answer. A DeviceDescriptor's `driver` names the class itself.
    """

    device: ClassVar[str]
    link_kind: ClassVar[type[Link]] = ByteLink  # type: ignore[type-abstract]
    address: ClassVar[str] = "serial:///dev/ttyUSB0?baud=9600"
    options_kind: ClassVar[type[PositionerOptions]] = PositionerOptions
    resolution_m: ClassVar[float] = math.nan
    """Smallest step [m]."""
    stop_latency_s: ClassVar[float] = math.nan
    """Longest time until braking begins [s], and True if a halt ends a move under way: see :class:`PositionerFacts`."""
    interruptible: ClassVar[bool] = True
    stream = "motor"

    def __init__(self, settings: DriverSettings) -> None:
        self.facts = self.facts_of(read_options(self.options_kind, settings.options, self.device))
        self.state: PositionerState | None = None
        """State read last; None: no state was read yet."""
        self._unread: list[PositionerState] = []
        self._moving = self._retreats = False
        self._goal, self._nearest, self._due_ns, self._halts, self._fastest = math.nan, math.inf, 0, 0, 0.0
        self._before_ns, self._odd = 0, False
        self._rest = self._came = b""
        self._asked_ns: int | None = None
        self._read_ns = 0
        """Time at which lines were last read [ns]."""
        super().__init__(settings)
        self.homed = False
        """True if the axis is homed: positions are known and ends of travel enforced."""
        self.enabled = False
        """True if the axis has power, as far as is known."""

    @classmethod
    def facts_of(cls, options: Any) -> PositionerFacts:
        """Return the properties of an axis with these options, without opening its link."""
        return PositionerFacts(
            limits=(_or(options.lower_m, math.nan), _or(options.upper_m, math.nan)),
            resolution=cls.resolution_m,
            corridor=_or(options.corridor_m, 0.0),
            speed=_or(options.speed_m_s, math.inf),
            acceleration=_or(options.acceleration_m_s2, math.inf),
            stop_latency_s=cls.stop_latency_s,
            interruptible=cls.interruptible,
            holds_unpowered=options.holds_unpowered,
            retreat=_or(options.retreat_m, math.nan),
            retreat_speed=_or(options.retreat_speed_m_s, math.nan),
        )

    # Methods of a subclass --------------------------------------------------------------------------------------------

    @abstractmethod
    def home(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Find the origin of positions, and set the ends of travel; afterwards the axis has power.

        Parameters
        ----------
        stop
            Function called repeatedly while homing; if it returns true, halt at once and raise PositionerError.
        """

    def enable(self) -> None:
        """Give the axis power; it holds its place. A subclass sends the command, if its controller has one."""
        self.enabled = True

    @abstractmethod
    def disable(self) -> None:
        """Switch the axis' power off. It may fall if :attr:`PositionerFacts.holds_unpowered` is false."""

    @abstractmethod
    def move_to(self, position: float, speed: float | None = None) -> float:
        """Begin a move to the step nearest to a position; return its position. Speed None: that of the facts."""

    @abstractmethod
    def halt(self) -> None:
        """Begin to brake, then hold; this replaces any move."""

    def halt_harder(self) -> None:
        """Halt by a stronger means, such as a reset, after `HALTS` halts in vain; raises if there is no such means."""
        raise PositionerError(f"The axis was halted {HALTS} times, and still moves.", hint="Cut its power supply.")

    @abstractmethod
    def update(self, timeout_s: float = 0.0) -> None:
        """Read the state and continue moves, waiting at most `timeout_s` for the controller."""

    def retreat(self) -> None:
        """Halt, then move to the place away from the skin, if one is stated; this replaces any move."""
        self.halt()
        self._retreats = math.isfinite(self.facts.retreat)

    def find_home(self) -> bool:
        """Return True if the controller is still homed after a restart of this program, and set :attr:`homed`.

        The base class returns False; a subclass queries its controller.
        """
        return False

    def confirm(self) -> None:
        """Read back the limits that the controller enforces; raises PositionerError if they differ from the options."""

    def rescue(self, within_s: float | None) -> float:
        """Retreat with a controller set up by another process, without set-up or homing; return the last position.

        Parameters
        ----------
        within_s
            Timeout for the retreat [s]; None: only halt, at any place.

        Raises
        ------
        PositionerError, LinkError
            If the axis does not reach its place of retreat, or the controller does not answer.
        """
        self.homed = self.enabled = True
        if within_s is None:
            self.halt()
            return self.position
        self.retreat()
        until_ns = self.clock() + round(1e9 * within_s)
        while self.clock() < until_ns:
            try:
                self.update(0.01)
            except PositionerError:  # half an answer to the other process, or a lost one
                self.retreat()
            if not self.moving:
                return self.position
        raise PositionerSilentError(f"The retreat has not ended within {within_s:.1f} s, at {self.position:g} m.")

    # Calls of a subclass ----------------------------------------------------------------------------------------------

    def begin(self, target: float = math.nan, speed: float | None = None) -> None:
        """Register a move to a target that was sent, at a speed (None: that of the facts), and set its deadline.

        The deadline is the end of the way, and is extended while the axis comes nearer. The target NaN stands for a
        halt, infinity for homing, until the next call of this method.
        """
        facts, halted = self.facts, math.isnan(target)
        if not (halted and self._fastest):
            self._fastest = speed or max(facts.speed, facts.retreat_speed)
        seconds = facts.stop_latency_s + self._fastest / facts.acceleration if halted else math.inf
        if math.isfinite(target) and self.homed:
            seconds = facts.seconds(target - self.position, speed or facts.speed)
        self._halts = self._halts + 1 if halted else 0
        self._moving, self._goal, self._nearest, self._retreats = True, target, math.inf, False
        self._due_ns = self.clock() + round(1e9 * (seconds if math.isfinite(seconds) else HOMING_S))

    def see(self, t_ns: int, position: float, *, idle: bool, target: float | None = None, problem: str = "") -> None:
        """Register an answer: its time, the position, `idle` as the controller reports it, and other values.

        A move ends when the axis is idle at its target; an idle axis elsewhere has not begun to move. A halt ends when
        the axis is idle and its position equals that of the answer before. A homed axis that moves on after the time of
        braking is halted again.
        """
        last, halted, facts = self.position, math.isnan(self._goal), self.facts
        if target is None:
            target = position if halted else self._goal
        self.note(PositionerState(t_ns, position, target, problem))
        off = abs(position - (last if halted else self._goal))
        if idle and off <= (facts.resolution if halted else facts.near):
            self._moving, self._halts = False, 0
            if self._retreats:
                self.move_to(facts.retreat, facts.retreat_speed)
        elif off < self._nearest - facts.resolution and not halted:
            self._nearest, self._due_ns = off, max(self._due_ns, t_ns + round(1e9 * SETTLE_S))
        elif self._moving and halted and self.homed and t_ns > self._due_ns:
            retreats = self._retreats
            (self.halt if self._halts < HALTS else self.halt_harder)()
            self._retreats = retreats

    def lines(self, question: bytes, timeout_s: float) -> list[bytes]:
        """Send a query on a ByteLink, unless an answer is outstanding; return the lines received.

        The caller calls :meth:`answered` after the answer. An empty query is not sent, and has no answer. Raises
        PositionerSilentError if an answer takes longer than `SILENT_S`.
        """
        unread_s = 1e-9 * (self.clock() - self._read_ns)
        if question and self._asked_ns is None:
            self.link.write(question)
            self._asked_ns = self.clock()
        with suppress(LinkTimeout):
            self._rest += self.link.read(timeout_s).data
        *lines, self._rest = self._rest.split(b"\n")
        self._came = lines[-1] if lines else self._came
        self._read_ns = self.clock()
        patience_s = SILENT_S + (max(SILENT_S, unread_s) if lines else 0.0)  # the answer may be among them
        if self._asked_ns is not None and self.clock() - self._asked_ns > 1e9 * patience_s:
            self._asked_ns = None
            raise PositionerSilentError(
                f"{self.device} does not answer {question!r}; the last line received is {self._came!r}.",
                hint=f"Check the port, its baud rate, and that the driver is for this controller. "
                f"{self.link.silence_hint}",
            )
        return lines

    def answered(self) -> None:
        """Register that the answer was received: the next call of :meth:`lines` sends its query."""
        self._asked_ns = None

    def finish(self, stop: Callable[[], bool]) -> None:
        """Wait for the end of a move; halt and raise PositionerError if `stop` returns true or it takes too long."""
        while self.moving:
            self.update(0.05)
            self._end_in_time()
            if stop():
                self.halt()
                raise PositionerError("The axis was halted.")

    def _end_in_time(self) -> None:
        """Raise PositionerError for a move that has not ended by its deadline; :meth:`see` repeats halts."""
        if self._moving and self.clock() > self._due_ns and not math.isnan(self._goal):
            self._due_ns = self.clock() + round(1e9 * SETTLE_S)
            raise PositionerError(
                f"The axis has not reached {'its home' if math.isinf(self._goal) else f'{self._goal:g}'} in time; it "
                f"is at {self.position:g}.",
                hint="Check what is in its way, and that units and speed in the rig file are those of the controller.",
            )

    def note(self, state: PositionerState) -> None:
        """Store a state read from the controller.

        A position further from the last position than the axis can have moved is ignored once.

        Raises
        ------
        PositionerError
            If a second such position follows: the axis has lost its place, and is no longer homed.
        """
        last, facts, far = self.state, self.facts, False
        if last is not None and self.homed and self.enabled:
            # Each question is sent after the answer before: between the two positions at most the time since the last
            # answer but one has passed.
            most = FASTER * max(self._fastest, facts.speed) * 1e-9 * (state.t_ns - self._before_ns)
            far = abs(state.position - last.position) > most + facts.near
        if far and not self._odd:
            self._odd = True
            return
        self._before_ns, self.state, self._odd = 0 if last is None else last.t_ns, state, False
        self._unread.append(state)
        del self._unread[:-1000]
        if far and last is not None:
            self.homed = False
            raise PositionerError(
                f"The position went from {last.position:g} to {state.position:g}, faster than it can move: the axis "
                "has lost steps, or was restarted.",
                hint="Check that nothing is touched, and home the axis again.",
            )

    def check_move(self, position: float) -> None:
        """Raise NotReadyError unless a move to a position [m] may begin now."""
        low, high = self.facts.limits
        for wrong, problem, hint in (
            (self.moving, "The axis is moving.", "Wait for the end of its move, or let it retreat."),
            (not self.homed, "The axis is not homed.", "Use home()."),
            (math.isnan(low), "The axis has no ends of travel.", "Give lower_m and upper_m in the rig file."),
            (not self.enabled, "The axis has no power.", "Use enable()."),
            (
                not low - 1e-12 <= position <= high + 1e-12,
                f"{position:g} m is beyond the ends of travel, {low:g} to {high:g} m.",
                "Choose a target between these.",
            ),
        ):
            if wrong:
                raise NotReadyError(problem, hint=hint)

    # As a device ------------------------------------------------------------------------------------------------------

    @property
    def moving(self) -> bool:
        """True if a move is under way, by the last state read."""
        return self._moving

    @property
    def position(self) -> float:
        """Position read last; NaN: not read yet."""
        return math.nan if self.state is None else self.state.position

    def move_by(self, distance: float) -> float:
        """Begin a move by a distance [m] from the last target, to the nearest step; return the new target."""
        if self.state is None or math.isnan(self.state.target):
            raise NotReadyError("The axis' target is not known.", hint="Read its state once it is at rest.")
        return self.move_to(self.state.target + distance)

    def at(self, position: float) -> bool:
        """Return True if the last position is `position`, within :attr:`PositionerFacts.near`."""
        return abs(self.position - position) <= self.facts.near

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The stream `motor`, at the rate that the serial line permits."""
        channels = (
            ChannelSpec(name="position", kind="position", unit="m"),
            ChannelSpec(name="target", kind="position", unit="m"),
        )
        return (StreamSpec(name=self.stream, channels=channels),)

    def start(self) -> None:
        """Read the state once; a subclass first sets its controller up."""
        self.update(0.0)

    def read(self, timeout_s: float) -> list[Block]:
        """Return the states read since the last call, and continue moves; raises the errors of :meth:`update`."""
        until_ns = self.clock() + round(1e9 * timeout_s)
        self.update(timeout_s)
        self._end_in_time()
        while not self._unread and (left_ns := until_ns - self.clock()) > 0:
            self.update(1e-9 * left_ns)
        states, self._unread = self._unread, []
        if not states:
            return []
        data = np.array([(one.position, one.target) for one in states])
        marks = ~np.isfinite(data) * np.uint8(Quality.MISSING)
        t_ns = np.array([one.t_ns for one in states], dtype=np.int64)
        return [Block(stream=self.stream, t_ns=t_ns, data=data, quality=marks if marks.any() else None)]

    def stop(self) -> None:
        """Drop unread states. The axis completes its move, and holds."""
        self._unread = []


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
