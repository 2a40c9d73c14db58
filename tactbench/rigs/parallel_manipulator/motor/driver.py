"""The driver of the linear motor: set up, homed, moved by increments, retreated, and watched.

Positions are in metres. Nothing but :meth:`FaulhaberDriver.home` and the moves lets the motor move, and nothing but
:meth:`~FaulhaberDriver.enable` and homing gives it power: opening, starting, reading, stopping and closing do not.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tactbench.plugin import Block, ChannelSpec, Quality, StreamSpec
from tactbench.plugin.devices import ByteLink, Driver, DriverSettings
from tactbench.rigs.parallel_manipulator.motor.codec import Configuration, Kind, OperationStatus, fault_status
from tactbench.rigs.parallel_manipulator.motor.commands import FAULTS, Commands
from tactbench.rigs.parallel_manipulator.motor.errors import (
    MotorError,
    MotorFaultError,
    MotorNotReadyError,
    MotorRefusalError,
    MotorStalledError,
    SettingNotKeptError,
)
from tactbench.rigs.parallel_manipulator.motor.exchange import Answer, Exchange
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.options import open_for, read_options

STREAM = "motor"
SETTLE_S = 0.5
"""Added to the time that a move takes by its speed and acceleration (assumed)."""
CORRIDOR_M = 0.2e-3
"""How far target and position may be apart when the motor is switched on, and place and its name when it was homed
(assumed)."""

MOST_SAMPLES = 1000
"""That are kept for `read`: some ten seconds."""

_NO_STATUS = OperationStatus(0)
_WATCHED = ("POS", "GRC", "OST")


@dataclass(frozen=True)
class MotorState:
    """What is known of the motor."""

    t_ns: int
    """When the drive's answer with the position came, on the host's clock."""
    position_m: float
    current_a: float
    """Without sign; NaN: the drive does not say."""
    target_m: float
    """NaN: not known."""
    status: OperationStatus
    """A little later than the position."""


@dataclass(eq=False)
class _Move:
    target: int
    """Increments."""
    seconds: float
    """It takes at most."""
    moving: bool = False
    """Whether the drive has acknowledged its start."""
    due_ns: int = 0


class FaulhaberDriver(Driver):
    """A linear motor on a Faulhaber drive.

    As a device of a rig it has one stream, `motor`: position and target [m], current [A], polled as fast as the line
    allows, some 30 to 40 times a second at 9600 baud and 200 at 115200. `t_ns` is when the first byte of the position's
    answer was in the host; the drive has read it a few bytes of line earlier.

    For who moves it: :meth:`home`, :meth:`enable` and :meth:`disable` wait for their end, within a bound.
    :meth:`move_by`, :meth:`move_to` and :meth:`retreat` return at once; whoever calls :meth:`read` or :meth:`update`
    then carries them on, until :attr:`moving` is false. One move is out at a time; a retreat takes its place.

    What goes wrong raises in the call that notices it, once: an error of the drive by its name, a fault, a target that
    is not the one asked for, a move that does not end. The motor then ends the move it has, or holds; a retreat is
    possible after each of them but a drive without power or link.
    """

    def __init__(self, settings: DriverSettings) -> None:
        self._options = options = read_options(FaulhaberOptions, settings.options, "faulhaber")
        self._profile = options.profile()
        self._clock = settings.clock
        # Arguments that the drive does not have are refused here, before anything is sent.
        self._settings = self._required_settings()
        self._limits = [
            ("LL", self._profile.increments(end), query)
            for end, query in ((options.upper_m, "GPL"), (options.lower_m, "GNL"))
            if end is not None
        ]
        self._home = self._profile.increments(options.home_m)
        self._away = None if options.retreat_m is None else self._profile.increments(options.retreat_m)
        self._away_speed = None if options.retreat_speed_m_s is None else self._profile.speed(options.retreat_speed_m_s)
        self._version = ""
        self._link = open_for(settings, "faulhaber", ByteLink, "serial:///dev/ttyUSB0?baud=9600")  # type: ignore[type-abstract]
        self._exchange = Exchange(self._link, settings.clock, baud=options.baud, node=options.node)
        self._state: MotorState | None = None
        self._samples: deque[MotorState] = deque(maxlen=MOST_SAMPLES)
        self._counts: Counter[str] = Counter()
        self._commands = Commands(self._exchange, settings.clock, self._take)
        self._queue: deque[tuple[str, int | None]] = deque()
        self._watching = False
        self._turn = 0
        self._latest: dict[str, Answer] = {}
        self._move: _Move | None = None
        self._target: int | None = None
        self._speed = self._speed_now = 0
        self._acceleration_m_s2 = math.inf
        self._enabled = self._homed = self._in_fault = False
        self._problem: MotorError | None = None

    def _required_settings(self) -> list[tuple[str, int, str]]:
        """Return command, argument and the query that reads it back, of what the options state."""
        options, profile = self._options, self._profile
        found: list[tuple[str, int, str]] = []
        if options.speed_m_s is not None:
            found.append(("SP", profile.speed(options.speed_m_s), "GSP"))
        if options.acceleration_m_s2 is not None:
            argument = profile.acceleration(options.acceleration_m_s2)
            found += [("AC", argument, "GAC"), ("DEC", argument, "GDEC")]
        if options.corridor_m is not None:
            found.append(("CORRIDOR", max(1, profile.increments(options.corridor_m)), "GCORRIDOR"))
        if options.peak_current_a is not None:
            found.append(("LPC", profile.current(options.peak_current_a), "GPC"))
        if options.continuous_current_a is not None:
            found.append(("LCC", profile.current(options.continuous_current_a), "GCC"))
        return found

    # The life of a device ---------------------------------------------------------------------------------------------

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """`motor`, at the rate that the line allows."""
        channels = (
            ChannelSpec(name="position", kind="position", unit="m"),
            ChannelSpec(name="current", kind="other", unit="A"),
            ChannelSpec(name="target", kind="position", unit="m"),
        )
        return (StreamSpec(name=STREAM, channels=channels),)

    @property
    def counts(self) -> Mapping[str, int]:
        """Those of :class:`Exchange`, ``faults``, and samples that nobody has read, ``unread``; but for those at 0."""
        return {name: count for name, count in (self._exchange.counts + self._counts).items() if count}

    def identify(self) -> Mapping[str, str]:
        """Return firmware, and model and serial number where the drive has them.

        Raises
        ------
        LinkTimeout
            If nothing answers.
        WrongGenerationError
            If it is a drive of the newer generation.
        """
        self._version = self._exchange.greet()
        found = {"firmware": self._version}
        for query, name in (("GTYP", "model"), ("GSER", "serial")):
            with suppress(MotorRefusalError):
                found[name] = self._commands.ask(query).text
        return found

    def start(self) -> None:
        """Let the drive acknowledge commands, set speeds and currents, read them back, and watch the motor.

        Raises
        ------
        LinkTimeout
            If nothing answers.
        SettingNotKeptError, MotorRefusalError
            If the drive does not take a setting.
        """
        if not self._version:
            self._version = self._exchange.greet()
        # What is answered to ANSW itself is in no source.
        self._exchange.send("ANSW", 2)
        self._exchange.quiet()
        if not self._commands.configuration() & Configuration.ACKNOWLEDGES:
            raise SettingNotKeptError("The motor's drive does not acknowledge commands after ANSW2.")
        self._commands.do("SOR", 0)
        for setting in self._settings:
            self._commands.keep(*setting)
        self._speed = self._speed_now = self._commands.sure("GSP")
        slowest = min(self._commands.sure("GAC"), self._commands.sure("GDEC"))
        self._acceleration_m_s2 = self._profile.acceleration_m_s2(slowest)
        self._enabled = bool(self._commands.configuration() & Configuration.POWER_STAGE)
        if self._enabled:
            self.locate()
        self._watching = True

    def read(self, timeout_s: float) -> list[Block]:
        """Return the positions that were asked for since the last call, and carry a move on.

        Raises
        ------
        MotorError
            What has gone wrong, as the class says.
        LinkUnplugged
            If the link is gone.
        """
        deadline = self._clock() + round(1e9 * timeout_s)
        while True:
            left_s = max(0.0, (deadline - self._clock()) / 1e9)
            self._go(left_s)
            if self._samples or left_s == 0.0:
                break
        states = list(self._samples)
        self._samples.clear()
        if not states:
            return []
        data = np.array([(state.position_m, state.current_a, state.target_m) for state in states])
        marks = np.where(np.isfinite(data), int(Quality.GOOD), int(Quality.MISSING)).astype(np.uint8)
        t_ns = np.array([state.t_ns for state in states], dtype=np.int64)
        return [Block(stream=STREAM, t_ns=t_ns, data=data, quality=marks if marks.any() else None)]

    def stop(self) -> None:
        """Watch no more. The motor ends the move it has, and holds."""
        self._watching = False
        self._samples.clear()

    def close(self) -> None:
        """Close the link. The motor ends the move it has, and holds."""
        self._link.close()

    # Motion -----------------------------------------------------------------------------------------------------------

    @property
    def state(self) -> MotorState | None:
        """What was last read; None: nothing yet."""
        return self._state

    @property
    def moving(self) -> bool:
        """Whether a move is under way, by what is known now."""
        return self._move is not None

    @property
    def enabled(self) -> bool:
        """Whether the motor has power, by what is known now."""
        return self._enabled

    @property
    def homed(self) -> bool:
        """Whether positions mean anything, and limits hold."""
        return self._homed

    @property
    def options(self) -> FaulhaberOptions:
        """What the rig file says of it."""
        return self._options

    def update(self, timeout_s: float = 0.0) -> MotorState | None:
        """Carry on what is under way, waiting at most `timeout_s` for the next byte; return what was last read.

        Raises
        ------
        MotorError, LinkUnplugged
            As :meth:`read`.
        """
        self._go(timeout_s)
        return self._state

    def enable(self) -> None:
        """Give the motor power; it holds its place.

        Raises
        ------
        DriveTooHotError, MotorRefusalError
            If the drive refuses.
        MotorFaultError
            If its target is elsewhere: it is without power again then.
        """
        self._commands.do("EN")
        self._in_fault = False
        self._enabled = bool(self._commands.configuration() & Configuration.POWER_STAGE)
        if not self._enabled:
            raise MotorFaultError("The motor's drive was enabled and has no power.", hint="Check its supply.")
        place, target = self._commands.sure("POS"), self._commands.sure("TPOS")
        if abs(self._profile.position_m(place - target)) > CORRIDOR_M:
            self.disable()
            raise MotorFaultError(
                f"The motor was to hold its place at {self._profile.position_m(place):g} m, and its target is "
                f"{self._profile.position_m(target):g} m; it is without power again.",
                hint="Home it anew.",
            )
        self._target = target

    def disable(self) -> None:
        """Take the motor's power; it can be pushed then. Raises a MotorError if that is not sure."""
        self._abort()
        self._commands.do("DI")
        self._enabled = False

    def locate(self) -> float:
        """Ask for place and target, each until two answers are the same; return the place [m].

        Raises
        ------
        MotorError
            If the motor does not stand still, or as :meth:`read`.
        """
        self._target = self._commands.sure("TPOS")
        return self._profile.position_m(self._commands.sure("POS"))

    def home(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Find the place that positions count from, as the options say, and set the ends of travel.

        The motor runs against an end stop or to its switch, for a minute at most, and has power afterwards; homed
        ``here`` it does not move. What the options say of current is that of the drive again once the place is found.

        Parameters
        ----------
        stop
            Asked after each answer of the drive while the motor runs: whether it shall stand at once.

        Raises
        ------
        MotorStalledError
            If the place is not found, or `stop` says so.
        SettingNotKeptError
            If the drive does not keep place or limits.
        MotorFaultError, MotorRefusalError, MotorSilentError, AnswerMissingError, LinkUnplugged
            If it ends otherwise.
        """
        if self.moving:
            raise MotorNotReadyError("The motor is moving.", hint="Wait for the end of its move, or let it retreat.")
        self._homed = False
        self._commands.do("APL", 0)
        if self._options.homing != "here":
            self.enable()
            speed = self._profile.speed(self._options.homing_speed_m_s)
            if self._options.homing == "switch":
                self._commands.to_switch(speed, stop)
            else:
                self._commands.against_stop(speed, self._profile.current(self._options.homing_current_a), stop)
        self._commands.do("HO", self._home)
        place = self._commands.sure("POS")
        if abs(self._profile.position_m(place - self._home)) > CORRIDOR_M:
            raise SettingNotKeptError(
                f"The motor's place was to be called {self._options.home_m:g} m, and is "
                f"{self._profile.position_m(place):g} m."
            )
        for setting in self._limits:
            self._commands.keep(*setting)
        if self._limits:
            self._commands.do("APL", 1)
            if not self._commands.configuration() & Configuration.POSITION_LIMITS:
                raise SettingNotKeptError("The motor's drive does not hold the ends of travel after APL1.")
        self._homed = True
        if self._enabled and self._limits:
            # Position control again, from a target that is known, within the ends of travel.
            (_, upper, _), (_, lower, _) = self._limits
            self._begin("LA", min(max(self._home, lower), upper))
            while self.moving:
                self._go(self._exchange.answer_s)

    def confirm(self) -> None:
        """Read back every setting and the ends of travel that the options state; nothing is set.

        Raises
        ------
        SettingNotKeptError
            If the drive has another one: it was set by somebody else, or has been without power.
        AnswerMissingError, MotorSilentError, MotorRefusalError, LinkUnplugged
            If it does not answer.
        """
        speed = ("SP", self._speed_now, "GSP")
        for command, argument, query in [speed, *(one for one in self._settings if one[0] != "SP"), *self._limits]:
            found = self._commands.sure(query)
            if found != argument:
                raise SettingNotKeptError(
                    f"The motor's drive was told {command}{argument} and answers {query} with {found}.",
                    hint="Was it without power, or set by another program? Start it anew and home it.",
                )
        if self._limits and not self._commands.configuration() & Configuration.POSITION_LIMITS:
            raise SettingNotKeptError("The motor's drive does not hold the ends of travel any more.")

    def move_by(self, distance_m: float) -> float:
        """Begin to move from the last target by a distance, to the nearest increment; return the new target [m].

        Raises
        ------
        MotorNotReadyError
            If a move is under way; if the motor is not homed, without power or without ends of travel; if the last
            target is not known, or the new one is beyond the ends. Nothing is sent.
        """
        if self._target is None:
            raise MotorNotReadyError("The motor's target is not known.", hint="Use locate() once it is at rest.")
        return self._begin("LR", self._target + self._profile.increments(distance_m))

    def move_to(self, position_m: float, speed_m_s: float | None = None) -> float:
        """Begin to move to a position, to the nearest increment; return it [m].

        `speed_m_s` is of this move, rounded down; None: that of the options. Raises as :meth:`move_by`, and RigError
        for a speed that the drive does not have.
        """
        speed = None if speed_m_s is None else self._profile.speed(speed_m_s)
        return self._begin("LA", self._profile.increments(position_m), speed)

    def halt(self) -> None:
        """Begin to move to the position that was last read, whatever is under way: the motor brakes and holds there.

        Two commands are sent at once, without waiting for answers that are out; it stays under position control. Raises
        as :meth:`retreat`, and MotorNotReadyError if no position was read yet.
        """
        if self._state is None or not self._homed:
            raise MotorNotReadyError("The motor's position is not known.", hint="Home it, and read it.")
        self._at_once(self._profile.increments(self._state.position_m), None)

    def retreat(self) -> None:
        """Begin to move to the place that the options state as away from the sensor, whatever is under way.

        Three commands at most are sent at once, without waiting for answers that are out. Where they are not answered,
        `update` raises AnswerMissingError: call this again, it is the same wherever the motor is.

        Raises
        ------
        MotorNotReadyError
            If the options name no such place, or the motor is not homed.
        LinkTimeout, LinkUnplugged
            As the link.
        """
        if self._away is None or not self._homed:
            raise MotorNotReadyError("The motor has no place to retreat to.", hint="Give retreat_m, and home it.")
        self._at_once(self._away, self._away_speed)

    def _at_once(self, target: int, speed: int | None) -> None:
        self._abort()
        self._speed_now = speed or self._speed_now
        self._move = move = _Move(target, self._seconds(self._travel_m, self._speed_now or self._speed))
        if speed is not None:
            self._exchange.send("SP", speed, move)
        self._exchange.send("LA", target, move)
        self._exchange.send("M", None, move)
        self._queue.append(("TPOS", None))

    def _begin(self, command: Literal["LA", "LR"], target: int, speed: int | None = None) -> float:
        position_m = self._profile.position_m(target)
        speed = speed or self._speed
        for wrong, problem, hint in (
            (self.moving, "The motor is moving.", "Wait for the end of its move, or let it retreat."),
            (not self._homed, "The motor is not homed.", "Use home()."),
            (not self._limits, "The motor has no ends of travel.", "Give lower_m and upper_m in the rig file."),
            (not self._enabled, "The motor has no power.", "Use enable()."),
        ):
            if wrong:
                raise MotorNotReadyError(problem, hint=hint)
        (_, upper, _), (_, lower, _) = self._limits
        if not lower <= target <= upper:
            raise MotorNotReadyError(
                f"{position_m:g} m is beyond the ends of travel, {self._options.lower_m:g} to "
                f"{self._options.upper_m:g} m.",
                hint="Ask for less.",
            )
        distance = target - self._target if self._target is not None else None
        distance_m = self._travel_m if distance is None else abs(self._profile.position_m(distance))
        self._move = _Move(target, self._seconds(distance_m, speed))
        if self._speed_now != speed:
            self._queue.append(("SP", speed))
            self._speed_now = speed
        self._queue += [
            ("LA", target) if command == "LA" or distance is None else ("LR", distance),
            ("M", None),
            ("TPOS", None),
        ]
        return position_m

    def _seconds(self, distance_m: float, speed: int) -> float:
        """Return how long a move takes at most."""
        speed_m_s = self._profile.speed_m_s(max(1, speed))
        ramps_s = 2.0 * speed_m_s / self._acceleration_m_s2
        return distance_m / speed_m_s + ramps_s + SETTLE_S + 4.0 * self._exchange.answer_s

    @property
    def _travel_m(self) -> float:
        return (self._options.upper_m or 0.0) - (self._options.lower_m or 0.0)

    def _abort(self) -> None:
        """Send no more of what is under way."""
        if any(name == "SP" for name, _ in self._queue):
            self._speed_now = 0  # Not sent: the next move sends one.
        self._queue.clear()
        self._move, self._target = None, None

    # What comes and goes ----------------------------------------------------------------------------------------------

    def _go(self, timeout_s: float) -> None:
        """Send what is next, take what comes, waiting at most `timeout_s` for a byte of it; raise what is wrong."""
        if self._exchange.ready:
            self._next()
        try:
            for answer in self._exchange.pump(timeout_s):
                self._take(answer)
        except MotorError:
            self._abort()
            raise
        if self._exchange.ready:
            self._next()
        self._raise()

    def _raise(self) -> None:
        for _, letter in self._exchange.notices:
            if letter in "fr" and not self._in_fault:
                # Which fault it is; raised with the answer.
                self._queue.appendleft(("GFS", None))
        self._exchange.notices.clear()
        if self._problem is not None:
            problem, self._problem = self._problem, None
            raise problem

    def _next(self) -> None:
        if self._queue:
            name, argument = self._queue.popleft()
            self._exchange.send(name, argument, self._move)
        elif self._watching:
            self._exchange.send(_WATCHED[self._turn])

    def _take(self, answer: Answer) -> None:
        try:
            if answer.name in _WATCHED:
                self._watched(answer)
            elif answer.name == "GFS":
                self._fault(answer)
            elif answer.name == "TPOS":
                self._check_target(answer)
            elif answer.of is self._move is not None:
                self._moved_on(self._move, answer)
        except MotorError as error:
            self._problem = self._problem or error

    def _moved_on(self, move: _Move, answer: Answer) -> None:
        try:
            answer.checked()
        except MotorError:
            self._abort()
            raise
        if answer.name == "M":
            move.moving = True
            move.due_ns = self._clock() + round(1e9 * move.seconds)
            self._target = move.target

    def _check_target(self, answer: Answer) -> None:
        if answer.line is None:
            self._queue.appendleft(("TPOS", None))
        elif self._target is not None and answer.value != self._target:
            expected, found = (self._profile.position_m(steps) for steps in (self._target, answer.value))
            self._abort()
            raise MotorFaultError(
                f"The motor's target is {found:g} m, and {expected:g} m was asked for.",
                hint="A byte was damaged on the line: let it retreat, and check the cable.",
            )

    def _watched(self, answer: Answer) -> None:
        if answer.line is None:
            # Asked again, from the start: position, current and status belong together.
            self._turn = 0
            return
        if answer.name != "GRC":
            answer.checked()
        self._latest[answer.name] = answer
        self._turn = (self._turn + 1) % len(_WATCHED)
        if self._turn == 0:
            self._complete()

    def _complete(self) -> None:
        position, current, status_ = (self._latest[name] for name in _WATCHED)
        says_current = current.line is not None and current.line.kind is Kind.VALUE
        status = OperationStatus(status_.value)
        self._state = MotorState(
            t_ns=position.t_ns,
            position_m=self._profile.position_m(position.value),
            current_a=self._profile.current_a(current.value) if says_current else math.nan,
            target_m=math.nan if self._target is None else self._profile.position_m(self._target),
            status=status,
        )
        self._counts["unread"] += len(self._samples) == MOST_SAMPLES
        self._samples.append(self._state)
        if status & FAULTS:
            self._fault(None, status)
        else:
            self._in_fault = False
        move = self._move
        if move is None or not move.moving:
            return
        if status & OperationStatus.POSITION_ATTAINED:
            self._move = None
        elif self._clock() > move.due_ns:
            self._abort()
            limited = " at its current limit" if status & OperationStatus.CURRENT_LIMITATION else ""
            raise MotorStalledError(
                f"The motor stands at {self._state.position_m:g} m{limited} and has not reached "
                f"{self._profile.position_m(move.target):g} m within {move.seconds:.2f} s.",
                hint="Let it retreat, and see what is in its way.",
            )

    def _fault(self, answer: Answer | None, status: OperationStatus = _NO_STATUS) -> None:
        """Take a fault for a fact, once; raises MotorFaultError."""
        if self._in_fault:
            return
        self._in_fault = True
        self._counts["faults"] += 1
        self._enabled = False
        self._abort()
        names = [(bit.name or "").lower() for bit in FAULTS if bit & status]
        if answer is not None and answer.line is not None and answer.line.kind is Kind.VALUE:
            with suppress(ValueError):
                names = [name.replace("_", " ") for name, on in fault_status(answer.line.text)._asdict().items() if on]
        raise MotorFaultError(
            f"The motor's drive reports a fault: {', '.join(names) or 'it does not say which'}.",
            hint="The motor may be without power. Clear the cause, then enable it again.",
        )


def build(settings: DriverSettings) -> FaulhaberDriver:
    """Open the link; nothing is sent yet.

    Raises
    ------
    UsageError
        For options that are not known or contradict each other, or a link that carries no bytes.
    RigError
        For a setting that the drive does not have.
    LinkError
        If the link does not open.
    """
    return FaulhaberDriver(settings)
