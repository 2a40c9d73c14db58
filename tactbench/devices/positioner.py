"""Anything that moves along or about one axis: a linear motor, a rail of a manipulator, a stage."""

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
from tactbench.links.byte_link import ByteLink
from tactbench.links.link import Link

SILENT_S = 0.5
"""Timeout for an answer of a controller (assumed)."""
SETTLE_S = 0.5
"""Time beyond that of a move by its speed and acceleration, after which the move has failed (assumed)."""
HOMING_S = 60.0
"""Timeout for homing (assumed)."""
HALTS = 2
"""Number of halts before :meth:`Positioner.halt_harder` (assumed)."""
FASTER = 1.5
"""Factor over its stated speed at which an axis may seem to move; two positions further apart are no move (assumed)."""


class PositionerError(RigError):
    """An axis or its controller does not carry out a command."""


class PositionerSilentError(PositionerError):
    """The controller does not answer; whether it has carried out the last command is not known."""


class NotReadyError(PositionerError):
    """The move is not allowed now, or at all; nothing was sent."""


@dataclass(frozen=True)
class PositionerFacts:
    """Properties that an axis states; positions in m (or rad), those of a pressing axis positive into the skin."""

    limits: tuple[float, float]
    """Least and greatest position, which the controller keeps as well; NaN: not stated, and it is never moved."""
    resolution: float
    """Least step."""
    corridor: float
    """Largest distance from its target at which a move ends."""
    speed: float
    """Largest speed of a move."""
    acceleration: float
    """Acceleration of braking."""
    stop_latency_s: float
    """Longest time from the call of :meth:`Positioner.halt` or :meth:`~Positioner.retreat` to the begin of braking."""
    interruptible: bool
    """Whether `halt` and `retreat` end a move that is under way."""
    holds_unpowered: bool
    """Whether it keeps its place without power: a horizontal axis, a brake, a counterweight, a self-locking screw."""
    homes_here: bool = False
    """Whether homing takes the present place for the home, even one in the skin."""
    retreat: float = math.nan
    """Position away from the skin; NaN: it retreats by a halt."""
    retreat_speed: float = math.nan

    @property
    def near(self) -> float:
        """Largest distance from a place that counts as being there."""
        return max(self.corridor, 2.0 * self.resolution)

    def seconds(self, distance: float, speed: float) -> float:
        """Return the longest time of a move [s]."""
        return abs(distance) / speed + 2.0 * speed / self.acceleration + SETTLE_S


@dataclass(frozen=True)
class PositionerState:
    """State of an axis, as its controller reported it."""

    t_ns: int
    """Time at which the position was received, on the host's clock."""
    position: float
    target: float = math.nan
    """NaN: not known."""
    current_a: float = math.nan
    """Without sign; NaN: not known."""
    problem: str = ""
    """Reported condition that must end a press (current limit, deviation); empty: none."""


class PositionerOptions(Options):
    """Options of any axis in a rig file; a subclass adds those of its controller."""

    lower_m: float | None = None
    """Ends of travel, kept by the controller and by the driver; without them the axis can be read, not moved."""
    upper_m: float | None = None
    home_m: float = 0.0
    """Position of the place that homing finds."""
    speed_m_s: float | None = Field(default=None, gt=0.0)
    """Speed of moves."""
    acceleration_m_s2: float | None = Field(default=None, gt=0.0)
    """Acceleration of starting and braking."""
    corridor_m: float | None = Field(default=None, gt=0.0)
    """Distance from its target within which a move has ended: well below the shortest move."""
    retreat_m: float | None = None
    """Position away from the sensor."""
    retreat_speed_m_s: float | None = Field(default=None, gt=0.0)
    orientation: Literal["horizontal", "vertical"] | None = None
    """Direction of the axis; this and, of a vertical one, the next two must be stated before anything presses."""
    brake: bool | None = None
    """Whether a brake holds it without power."""
    counterweight: bool | None = None
    """Whether a counterweight or spring holds it without power."""
    peak_force_n: float | None = Field(default=None, gt=0.0)
    """Largest force that its drive can exert: the last bound where the force sensor reads wrong values."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        low, high = self.lower_m, self.upper_m
        if (low is None) != (high is None):
            raise ValueError("give both lower_m and upper_m, or none")
        if low is not None and high is not None:
            if not low < high:
                raise ValueError("lower_m is below upper_m")
            if self.retreat_m is not None and not low <= self.retreat_m <= high:
                raise ValueError("retreat_m is between lower_m and upper_m")
        return self

    @property
    def largest_force_n(self) -> float | None:
        """Largest force that the drive can exert [N]; None: not stated."""
        return self.peak_force_n

    @property
    def force_source(self) -> str:
        """Source of :attr:`largest_force_n`; that of a subclass whose driver sends a limit is another."""
        return "unknown" if self.largest_force_n is None else "declared"

    @property
    def holds_unpowered(self) -> bool:
        """Whether it keeps its place without power; False where that is not known."""
        return self.orientation == "horizontal" or bool(self.brake) or bool(self.counterweight)

    def homes_towards(self) -> int:
        """Return the sign of the direction in which homing moves; 0: it does not move, or that is not known."""
        return 0


class Positioner(Driver):
    """Driver of one axis.

    Only :meth:`home` and the moves let it move, and only :meth:`enable` and :meth:`home` give it power.
    :meth:`home`, :meth:`enable` and :meth:`disable` return at their end, within a bound. :meth:`move_to`,
    :meth:`move_by`, :meth:`halt` and :meth:`retreat` return at once; :meth:`update` is called until :attr:`moving` is
    false. `halt` and `retreat` replace a move that is under way; the other moves are refused then.

    The call that detects a failure raises PositionerSilentError, another PositionerError, or a LinkError.

    As a device of a rig an axis has one stream, `motor`: position, current and target, once per state that was read.
    A subclass has the abstract methods and the class attributes. It calls :meth:`check_move` before it sends a move,
    :meth:`begin` after, and :meth:`see` with each answer. A DeviceDescriptor's `driver` names the class itself.
    """

    device: ClassVar[str]
    link_kind: ClassVar[type[Link]] = ByteLink  # type: ignore[type-abstract]
    address: ClassVar[str] = "serial:///dev/ttyUSB0?baud=9600"
    options_kind: ClassVar[type[PositionerOptions]] = PositionerOptions
    resolution_m: ClassVar[float] = math.nan
    """Least step."""
    stop_latency_s: ClassVar[float] = math.nan
    """See :attr:`PositionerFacts.stop_latency_s`; likewise the next."""
    interruptible: ClassVar[bool] = True
    stream = "motor"

    def __init__(self, settings: DriverSettings) -> None:
        self.facts = self.facts_of(read_options(self.options_kind, settings.options, self.device))
        self.state: PositionerState | None = None
        """The last state; None: none was read yet."""
        self._unread: list[PositionerState] = []
        self._moving = self._retreats = False
        self._goal, self._nearest, self._due_ns, self._halts, self._fastest = math.nan, math.inf, 0, 0, 0.0
        self._before_ns, self._odd = 0, False
        self._rest = self._came = b""
        self._asked_ns: int | None = None
        self._read_ns = 0
        """Time at which lines were last read."""
        super().__init__(settings)
        self.homed = False
        """Whether positions are known, and limits hold."""
        self.enabled = False
        """Whether it has power, as far as is known."""

    @classmethod
    def facts_of(cls, options: Any) -> PositionerFacts:
        """Return the properties of an axis with these options; nothing is opened."""
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
        """Find the place that positions count from, and set the ends of travel; it has power afterwards.

        Parameters
        ----------
        stop
            Called repeatedly while it moves; true: halt at once and raise PositionerError.
        """

    def enable(self) -> None:
        """Give it power; it holds its place. A subclass sends the command, if there is one."""
        self.enabled = True

    @abstractmethod
    def disable(self) -> None:
        """Take its power. Where :attr:`PositionerFacts.holds_unpowered` is false it may fall."""

    @abstractmethod
    def move_to(self, position: float, speed: float | None = None) -> float:
        """Begin to move to a position, to the nearest step, which is returned; None: at the speed of the facts."""

    @abstractmethod
    def halt(self) -> None:
        """Begin to brake and hold; this replaces any move."""

    def halt_harder(self) -> None:
        """Halt by a stronger means, such as a reset, after `HALTS` halts in vain; raises if there is none."""
        raise PositionerError(f"It was halted {HALTS} times, and goes on.", hint="Cut its supply.")

    @abstractmethod
    def update(self, timeout_s: float = 0.0) -> None:
        """Read the state and continue moves, waiting at most `timeout_s` for the controller."""

    def retreat(self) -> None:
        """Halt, and at rest move to the place away from the skin, if there is one; this replaces any move."""
        self.halt()
        self._retreats = math.isfinite(self.facts.retreat)

    def find_home(self) -> bool:
        """Return whether the controller is homed already, after a restart of this program; set :attr:`homed` then.

        False here; a subclass queries its controller.
        """
        return False

    def confirm(self) -> None:
        """Read back the limits that the controller must keep; raises PositionerError if it has others."""

    def rescue(self, within_s: float | None) -> float:
        """Retreat with a controller that another process had, without set-up or homing; return the last position.

        Parameters
        ----------
        within_s
            Timeout for the way; None: halt at once, at any place.

        Raises
        ------
        PositionerError, LinkError
            If it does not come to its place of retreat, or does not answer.
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
        """Note that a move to a target was sent, at a speed (None: that of the facts), and set its deadline.

        The deadline is the time of the way, and is extended while the axis comes nearer. The target NaN stands for a
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

    def see(
        self,
        t_ns: int,
        position: float,
        *,
        idle: bool,
        target: float | None = None,
        current_a: float = math.nan,
        problem: str = "",
    ) -> None:
        """Note an answer: its time, the position, whether the controller reports that the axis is idle, and the rest.

        A move ends when the axis is idle at its target; an idle axis elsewhere has not begun. A halt ends when it is
        idle and the position is that of the answer before. A homed axis that moves on after the time of braking is
        halted again.
        """
        last, halted, facts = self.position, math.isnan(self._goal), self.facts
        if target is None:
            target = position if halted else self._goal
        self.note(PositionerState(t_ns, position, target, current_a, problem))
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
        """Send a question on a ByteLink, unless an answer is outstanding; return the lines received.

        The caller calls :meth:`answered` after the answer. An empty question is not sent, and has no answer. Raises
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
                f"{self.device} does not answer {question!r}; the last that came is {self._came!r}.",
                hint=f"Check the port, its baud rate, and that this is the controller that the driver is for. "
                f"{self.link.silence_hint}",
            )
        return lines

    def answered(self) -> None:
        """Note that the answer was received: the next call of :meth:`lines` sends its question."""
        self._asked_ns = None

    def finish(self, stop: Callable[[], bool]) -> None:
        """Wait for the end of a move; halts and raises PositionerError if `stop` returns true, or it lasts too long."""
        while self.moving:
            self.update(0.05)
            self._end_in_time()
            if stop():
                self.halt()
                raise PositionerError("The axis was halted.")

    def _end_in_time(self) -> None:
        """Raise PositionerError for a move that has not ended in its time; :meth:`see` repeats halts."""
        if self._moving and self.clock() > self._due_ns and not math.isnan(self._goal):
            self._due_ns = self.clock() + round(1e9 * SETTLE_S)
            raise PositionerError(
                f"It has not come {'home' if math.isinf(self._goal) else f'to {self._goal:g}'} in its time, and is at "
                f"{self.position:g}.",
                hint="See what is in its way, and whether units and speed in the rig file are the controller's.",
            )

    def note(self, state: PositionerState) -> None:
        """Store a state that was read.

        A position further from the last one than it can have moved since is ignored once.

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
                f"Its position has gone from {last.position:g} to {state.position:g}, faster than it moves: it has "
                "lost its place, or was started anew.",
                hint="See that nothing is touched, and home it anew.",
            )

    def check_move(self, position: float) -> None:
        """Raise NotReadyError unless a move to a position may begin now."""
        low, high = self.facts.limits
        for wrong, problem, hint in (
            (self.moving, "The axis is moving.", "Wait for the end of its move, or let it retreat."),
            (not self.homed, "The axis is not homed.", "Use home()."),
            (math.isnan(low), "The axis has no ends of travel.", "Give them in the rig file."),
            (not self.enabled, "The axis has no power.", "Use enable()."),
            (
                not low - 1e-12 <= position <= high + 1e-12,
                f"{position:g} m is beyond the ends of travel, {low:g} to {high:g} m.",
                "Ask for less.",
            ),
        ):
            if wrong:
                raise NotReadyError(problem, hint=hint)

    # As a device ------------------------------------------------------------------------------------------------------

    @property
    def moving(self) -> bool:
        """Whether a move is under way, by the last state."""
        return self._moving

    @property
    def position(self) -> float:
        """The last position; NaN: not read yet."""
        return math.nan if self.state is None else self.state.position

    def move_by(self, distance: float) -> float:
        """Begin to move from the last target by a distance, to the nearest step; return the new target."""
        if self.state is None or math.isnan(self.state.target):
            raise NotReadyError("The axis does not know its target.", hint="Read it once it is at rest.")
        return self.move_to(self.state.target + distance)

    def at(self, position: float) -> bool:
        """Return whether its last position is a given one."""
        return abs(self.position - position) <= self.facts.near

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The stream `motor`, at the rate that the line allows."""
        channels = (
            ChannelSpec(name="position", kind="position", unit="m"),
            ChannelSpec(name="current", kind="other", unit="A"),
            ChannelSpec(name="target", kind="position", unit="m"),
        )
        return (StreamSpec(name=self.stream, channels=channels),)

    def start(self) -> None:
        """Read the state once; a subclass sets its controller up first."""
        self.update(0.0)

    def read(self, timeout_s: float) -> list[Block]:
        """Return the states that were read since the last call, and continue moves; raises as :meth:`update`."""
        until_ns = self.clock() + round(1e9 * timeout_s)
        self.update(timeout_s)
        self._end_in_time()
        while not self._unread and (left_ns := until_ns - self.clock()) > 0:
            self.update(1e-9 * left_ns)
        states, self._unread = self._unread, []
        if not states:
            return []
        data = np.array([(one.position, one.current_a, one.target) for one in states])
        marks = ~np.isfinite(data) * np.uint8(Quality.MISSING)
        t_ns = np.array([one.t_ns for one in states], dtype=np.int64)
        return [Block(stream=self.stream, t_ns=t_ns, data=data, quality=marks if marks.any() else None)]

    def stop(self) -> None:
        """Drop unread states. The axis ends its move, and holds."""
        self._unread = []


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
