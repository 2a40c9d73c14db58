"""The linear motor on a Faulhaber drive: set up, homed, moved, retreated, and watched. Positions are in metres."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from tactbench.plugin.devices import (
    DriverSettings,
    LinkTimeout,
    NotReadyError,
    Positioner,
    PositionerFacts,
    PositionerState,
)
from tactbench.rigs.parallel_manipulator.motor.codec import (
    QUERIES,
    Configuration,
    Kind,
    Line,
    LineReader,
    OperationStatus,
    encode,
    line_time_s,
)
from tactbench.rigs.parallel_manipulator.motor.exchange import Answer, Exchange, MotorError, MotorRefusalError
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions

CORRIDOR_M = 0.2e-3
"""How far target and position may be apart when the motor is switched on, and place and its name when it was homed
(assumed)."""
LAG_S = 10e-3
"""From the drive's having a command to the motor's braking (assumed)."""
LONGEST_COMMAND = 9
"""Bytes that may be ahead of a retreat: one command is out at a time, the longest `LA-12345` (derived)."""
TRIES = 5
"""Answers of which two in a row must agree (assumed: damaged lines are rare)."""
HOMING_S = 60.0
"""Homing takes no longer (assumed)."""
AGAIN_S = 0.25
"""After which a rescue is sent once more where the motor does not come nearer (assumed)."""

_FAULTS = OperationStatus.OVERVOLTAGE | OperationStatus.OVERTEMPERATURE
_PROBLEMS = (OperationStatus.CURRENT_LIMITATION, OperationStatus.DEVIATION_ERROR)
_WATCHED = ("POS", "GRC", "OST")


@dataclass(eq=False)
class _Move:
    target: int
    """Increments."""
    seconds: float
    """It takes at most."""
    started: bool = False
    """Whether the drive has acknowledged its start."""
    due_ns: int = 0


def retreat_command(options: FaulhaberOptions) -> bytes:
    """Return the bytes of a retreat, the same wherever the motor is; without a place to retreat to, those of standing.

    Raises PositionerError if the drive does not have the speed.
    """
    if options.retreat_m is None or options.retreat_speed_m_s is None:
        return encode("V", 0)
    speed, place = options.speed(options.retreat_speed_m_s), options.increments(options.retreat_m)
    return encode("SP", speed) + encode("LA", place) + encode("M")


def _latency_s(options: FaulhaberOptions) -> float:
    """Return the time from the call of a retreat to the motor's braking: what is ahead of it, itself, and the lag."""
    return line_time_s(LONGEST_COMMAND + len(retreat_command(options)), options.baud) + LAG_S


def _required_settings(options: FaulhaberOptions) -> list[tuple[str, int, str]]:
    """Return command, argument and the query that reads it back, of what the options state."""
    stated = (
        ("SP", options.speed, options.speed_m_s, "GSP"),
        ("AC", options.acceleration, options.acceleration_m_s2, "GAC"),
        ("DEC", options.acceleration, options.acceleration_m_s2, "GDEC"),
        ("CORRIDOR", lambda corridor_m: max(1, options.increments(corridor_m)), options.corridor_m, "GCORRIDOR"),
        ("LPC", options.current, options.peak_current_a, "GPC"),
        ("LCC", options.current, options.continuous_current_a, "GCC"),
    )
    return [(command, of(value), query) for command, of, value, query in stated if value is not None]


def _required_limits(options: FaulhaberOptions) -> list[tuple[str, int, str]]:
    """Return the same of the ends of travel."""
    ends = ((options.upper_m, "GPL"), (options.lower_m, "GNL"))
    return [("LL", options.increments(end), query) for end, query in ends if end is not None]


class FaulhaberDriver(Positioner):
    """A linear motor on a Faulhaber drive of the 300x RS generation.

    Position and current are polled as fast as the line allows, some 30 to 40 times a second at 9600 baud and 200 at
    115200. The time of a state is when the first byte of the position's answer was in the host; the drive has read it
    a few bytes of line earlier. Every setting, limit and target is read back: the protocol has no checksum.
    """

    device = "faulhaber"
    options_kind = FaulhaberOptions

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self._options: FaulhaberOptions = self.options
        options = self._options
        self._home = options.increments(options.home_m)
        self._settings, self._limits = _required_settings(options), _required_limits(options)
        self._version = ""
        self._exchange = Exchange(self.link, settings.clock, options.baud)
        self._counts: Counter[str] = Counter()
        self._queue: deque[tuple[str, int | None]] = deque()
        self._watching = self._in_fault = False
        self._turn = 0
        self._latest: dict[str, Answer] = {}
        self._move: _Move | None = None
        self._target: int | None = None
        self._speed = self._speed_now = 0
        self._problem: MotorError | None = None

    @classmethod
    def facts_of(cls, options: FaulhaberOptions) -> PositionerFacts:
        """Return the facts, with the drive's increment, and the line's and the motor's latency.

        Raises
        ------
        RigError
            For a setting that the drive does not have.
        """
        _required_settings(options)
        _required_limits(options)
        return replace(super().facts_of(options), resolution=options.increment_m, stop_latency_s=_latency_s(options))

    # The life of a device ---------------------------------------------------------------------------------------------

    @property
    def counts(self) -> Mapping[str, int]:
        """Those of :class:`Exchange`, and ``faults``; but for those at 0."""
        return {name: count for name, count in (self._exchange.counts + self._counts).items() if count}

    def identify(self) -> Mapping[str, str]:
        """Return firmware, and model and serial number where the drive has them."""
        self._version = self._exchange.greet()
        found = {"firmware": self._version}
        for query, name in (("GTYP", "model"), ("GSER", "serial")):
            with suppress(MotorRefusalError):
                found[name] = self._ask(query).checked().text
        return found

    def start(self) -> None:
        """Let the drive acknowledge commands, set speeds and currents, read them back, and watch the motor."""
        if not self._version:
            self._version = self._exchange.greet()
        # What is answered to ANSW itself is in no source.
        self._exchange.send("ANSW", 2)
        self._exchange.quiet()
        if not self._configuration() & Configuration.ACKNOWLEDGES:
            raise MotorError("The motor's drive does not acknowledge commands after ANSW2.")
        self._ask("SOR", 0)
        for setting in self._settings:
            self._keep(*setting)
        self._speed = self._speed_now = self._sure("GSP")
        self.enabled = bool(self._configuration() & Configuration.POWER_STAGE)
        if self.enabled:
            self.locate()
        self._watching = True

    def stop(self) -> None:
        """Watch no more. The motor ends the move it has, and holds."""
        self._watching = False
        super().stop()

    # Power and place --------------------------------------------------------------------------------------------------

    def enable(self) -> None:
        """Give the motor power; it holds its place. One whose target is elsewhere is without power again."""
        self._ask("EN")
        self._in_fault = False
        self.enabled = bool(self._configuration() & Configuration.POWER_STAGE)
        if not self.enabled:
            raise MotorError("The motor's drive was enabled and has no power.", hint="Check its supply.")
        place, target = self._sure("POS"), self._sure("TPOS")
        if abs(self._options.position_m(place - target)) > CORRIDOR_M:
            self.disable()
            raise MotorError(
                f"The motor was to hold its place at {self._options.position_m(place):g} m, and its target is "
                f"{self._options.position_m(target):g} m; it is without power again.",
                hint="Home it anew.",
            )
        self._target = target

    def disable(self) -> None:
        """Take the motor's power; it can be pushed then, and falls where nothing holds it."""
        self._abort()
        self._ask("DI")
        self.enabled = False

    def locate(self) -> float:
        """Ask for place and target, each until two answers are the same; return the place [m]."""
        self._target = self._sure("TPOS")
        return self._options.position_m(self._sure("POS"))

    def find_home(self) -> bool:
        """Whether the drive has kept power and the ends of travel that homing set: it counts from the same place then.

        A drive that was without supply has neither (assumed: its power stage is off until EN).
        """
        kept = Configuration.POWER_STAGE | Configuration.POSITION_LIMITS
        if not self._limits or self._configuration() & kept != kept:
            return False
        self.homed = all(self._sure(query) == argument for _, argument, query in self._limits)
        if self.homed:
            self.locate()
        return self.homed

    def home(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Find the place that positions count from, as the options say, and set the ends of travel.

        The motor runs against an end stop or to its switch, for a minute at most; homed ``here`` it does not move. What
        the options say of current is that of the drive again once the place is found.
        """
        if self.moving:
            raise NotReadyError("The motor is moving.", hint="Wait for the end of its move, or let it retreat.")
        self.homed = False
        self._ask("APL", 0)
        if self.options.homing != "here":
            self.enable()
            speed = self._options.speed(self.options.homing_speed_m_s)
            if self.options.homing == "switch":
                self._to_switch(abs(speed), stop)
            else:
                self._against_stop(speed, self._options.current(self.options.homing_current_a), stop)
        self._ask("HO", self._home)
        place = self._sure("POS")
        if abs(self._options.position_m(place - self._home)) > CORRIDOR_M:
            raise MotorError(
                f"The motor's place was to be called {self.options.home_m:g} m, and is "
                f"{self._options.position_m(place):g} m."
            )
        for setting in self._limits:
            self._keep(*setting)
        if self._limits:
            self._ask("APL", 1)
            if not self._configuration() & Configuration.POSITION_LIMITS:
                raise MotorError("The motor's drive does not hold the ends of travel after APL1.")
        self.homed = True
        if self.enabled and self._limits:
            # Position control again, from a target that is known, within the ends of travel.
            (_, upper, _), (_, lower, _) = self._limits
            self._begin(min(max(self._home, lower), upper), self._speed)
            while self.moving:
                self.update(self._exchange.answer_s)

    def confirm(self) -> None:
        """Read back every setting and the ends of travel that the options state; raises MotorError if one differs."""
        speed = ("SP", self._speed_now, "GSP")
        for command, argument, query in [speed, *(one for one in self._settings if one[0] != "SP"), *self._limits]:
            self._same(command, argument, query)
        if self._limits and not self._configuration() & Configuration.POSITION_LIMITS:
            raise MotorError("The motor's drive does not hold the ends of travel any more.")

    def _to_switch(self, speed: int, stop: Callable[[], bool]) -> None:
        """Run to the drive's reference switch, which is place 0 then; the motor stands if it fails."""
        self._ask("HOSP", speed)
        self._ask("GOHOSEQ")

        def done(status: OperationStatus) -> bool:
            return not status & OperationStatus.HOMING and bool(status & OperationStatus.POSITION_ATTAINED)

        try:
            self._until(done, stop, "its reference switch")
        except MotorError:
            self._ask("V", 0)
            raise

    def _against_stop(self, speed: int, current: int, stop: Callable[[], bool]) -> None:
        """Run at a speed and with little current until the motor stands at its current limit."""
        before = [("LPC", self._sure("GPC"), "GPC"), ("LCC", self._sure("GCC"), "GCC")]
        for command, argument, query in before:
            self._keep(command, min(current, argument), query)

        def done(status: OperationStatus) -> bool:
            return bool(status & OperationStatus.CURRENT_LIMITATION) and self._ask("GN").value == 0

        try:
            self._ask("V", speed)
            self._until(done, stop, "an end stop")
        finally:
            self._ask("V", 0)
        for setting in before:
            self._keep(*setting)

    def _until(self, done: Callable[[OperationStatus], bool], stop: Callable[[], bool], what: str) -> None:
        """Wait until the status is so twice in a row."""
        deadline = self.clock() + round(1e9 * HOMING_S)
        times = 0
        while times < 2:
            status = OperationStatus(self._ask("OST").value)
            if status & _FAULTS:
                raise MotorError("The motor's drive reports a fault while it looks for its place.")
            times = times + 1 if done(status) else 0
            if stop():
                raise MotorError(f"The motor was told to stand while it looked for {what}.")
            if self.clock() > deadline:
                raise MotorError(
                    f"The motor has not found {what} within {HOMING_S:g} s.",
                    hint="Check homing, homing_speed_m_s and homing_current_a in the rig file.",
                )

    # Motion -----------------------------------------------------------------------------------------------------------

    @property
    def moving(self) -> bool:
        """Whether a move is under way, by what is known now."""
        return self._move is not None

    def move_to(self, position: float, speed: float | None = None) -> float:
        """Begin to move to a position, to the nearest increment; the speed is rounded down."""
        self.check_move(position)
        return self._begin(
            self._options.increments(position), self._speed if speed is None else self._options.speed(speed)
        )

    def move_by(self, distance: float) -> float:
        """Begin to move from the last target by a distance, to the nearest increment; return the new target."""
        if self._target is None:
            raise NotReadyError("The motor's target is not known.", hint="Use locate() once it is at rest.")
        target = self._target + self._options.increments(distance)
        self.check_move(self._options.position_m(target))
        return self._begin(target, self._speed)

    def halt(self) -> None:
        """Begin to move to the position that was last read, whatever is under way: it brakes and holds there.

        Two commands are sent at once, without waiting for answers that are out.
        """
        if self.state is None or not self.homed:
            raise NotReadyError("The motor's position is not known.", hint="Home it, and read it.")
        self._at_once(self._options.increments(self.position), None)

    def retreat(self) -> None:
        """Begin to move to the place away from the sensor, whatever is under way; without one it halts.

        Three commands at most are sent at once. Where they are not answered, `update` raises MotorSilentError: call
        this again, it is the same wherever the motor is.
        """
        if math.isnan(self.facts.retreat):
            self.halt()
            return
        if not self.homed:
            raise NotReadyError("The motor has no place to retreat to.", hint="Home it.")
        speed = self.options.retreat_speed_m_s
        self._at_once(
            self._options.increments(self.facts.retreat), None if speed is None else self._options.speed(speed)
        )

    def _at_once(self, target: int, speed: int | None) -> None:
        self._abort()
        self._speed_now = speed or self._speed_now
        low, high = self.facts.limits
        self._move = move = _Move(target, self._seconds(high - low, self._speed_now or self._speed))
        if speed is not None:
            self._exchange.send("SP", speed, move)
        self._exchange.send("LA", target, move)
        self._exchange.send("M", None, move)
        self._queue.append(("TPOS", None))

    def _begin(self, target: int, speed: int) -> float:
        position_m = self._options.position_m(target)
        low, high = self.facts.limits
        way_m = high - low if self._target is None else abs(self._options.position_m(target - self._target))
        self._move = _Move(target, self._seconds(way_m, speed))
        if self._speed_now != speed:
            self._queue.append(("SP", speed))
            self._speed_now = speed
        self._queue += [("LA", target), ("M", None), ("TPOS", None)]
        return position_m

    def _seconds(self, way_m: float, speed: int) -> float:
        return self.facts.seconds(way_m, max(1, speed) * self._options.speed_unit_m_s) + 4.0 * self._exchange.answer_s

    def _abort(self) -> None:
        """Send no more of what is under way."""
        if any(name == "SP" for name, _ in self._queue):
            self._speed_now = 0  # Not sent: the next move sends one.
        self._queue.clear()
        self._move, self._target = None, None

    def rescue(self, within_s: float | None) -> float:
        """Retreat, or stand, with a drive that another process had; see `Positioner`.

        The drive keeps its positions; nothing else is assumed of what stands on the line. Half a command that may stand
        there is ended first, so that the first answer may be a refusal.
        """
        command, target_m = b"\r" + retreat_command(self.options), self.facts.retreat
        if within_s is None or math.isnan(target_m):
            self.link.write(b"\r" + encode("V", 0))
            return math.nan
        self.link.write(command)
        reader, there, place_m, nearest_m = LineReader(), 0, math.nan, math.inf
        sent_ns = self.clock()
        deadline = sent_ns + round(1e9 * within_s)
        while self.clock() < deadline:
            self.link.write(encode("POS"))
            requested_ns, place_m = self.clock(), math.nan
            while math.isnan(place_m) and self.clock() - requested_ns < 1e9 * self._exchange.answer_s:
                with suppress(LinkTimeout):
                    for line in reader.feed(self.link.read(self._exchange.answer_s).data):
                        if line.kind is Kind.VALUE:
                            place_m = self._options.position_m(line.value)
            away_m = abs(place_m - target_m)
            there = there + 1 if away_m <= self.facts.near else 0
            if there == 2:  # One could be the late answer to another question.
                return place_m
            if away_m < nearest_m:
                nearest_m, sent_ns = away_m, self.clock()
            elif not there and self.clock() - sent_ns > 1e9 * AGAIN_S:
                self.link.write(command)
                sent_ns = self.clock()
        where = "does not say where it is" if math.isnan(place_m) else f"is at {place_m:g} m"
        raise MotorError(
            f"The motor was sent to {target_m:g} m, and {where} {within_s:.1f} s later.",
            hint="Stand clear, cut its supply, and see what is in its way.",
        )

    # Commands that are waited for -------------------------------------------------------------------------------------

    def _ask(self, name: str, argument: int | None = None) -> Answer:
        """Return the answer to a command once it has come; a query that is not answered is asked again."""
        while True:
            while not self._exchange.ready:
                for answer in self._exchange.pump(self._exchange.answer_s):
                    self._take(answer)
            self._exchange.send(name, argument)
            found: list[Answer] = []
            while not found:
                found = self._exchange.pump(self._exchange.answer_s)
            if found[0].line is not None or name not in QUERIES:
                found[0].checked()
                return found[0]

    def _sure(self, query: str) -> int:
        """Return a number that two answers in a row agree on: there is no checksum."""
        before = None
        for _ in range(TRIES):
            value = self._ask(query).value
            if value == before:
                return value
            before = value
        raise MotorError(f"The motor's drive gives no two equal answers in a row to {query}.", hint="Is it at rest?")

    def _configuration(self) -> Configuration:
        return Configuration(self._sure("CST"))

    def _keep(self, command: str, argument: int, query: str) -> None:
        """Set something and read it back."""
        self._ask(command, argument)
        if self._sure(query) != argument:  # a digit may have been damaged on its way
            self._ask(command, argument)
            self._same(command, argument, query)

    def _same(self, command: str, argument: int, query: str) -> None:
        """Raise MotorError unless a setting is what was set."""
        if (found := self._sure(query)) != argument:
            raise MotorError(
                f"The motor's drive has {query} {found} where {command}{argument} was set.",
                hint="Was it without power, or set by another program? Check the option against the drive's manual.",
            )

    # What comes and goes ----------------------------------------------------------------------------------------------

    def update(self, timeout_s: float = 0.0) -> None:
        """Send what is next, take what comes, waiting at most `timeout_s` for a byte of it; raise what is wrong."""
        self._next()
        try:
            for answer in self._exchange.pump(timeout_s):
                self._take(answer)
        except MotorError:
            self._abort()
            raise
        self._next()
        if self._problem is not None:
            problem, self._problem = self._problem, None
            raise problem

    def _next(self) -> None:
        if not self._exchange.ready:
            return
        if self._queue:
            name, argument = self._queue.popleft()
            self._exchange.send(name, argument, self._move)
        elif self._watching:
            self._exchange.send(_WATCHED[self._turn])

    def _take(self, answer: Answer) -> None:
        try:
            if answer.name in _WATCHED:
                self._watched(answer)
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
            move.started = True
            move.due_ns = self.clock() + round(1e9 * move.seconds)
            self._target = move.target

    def _check_target(self, answer: Answer) -> None:
        if answer.line is None:
            self._queue.appendleft(("TPOS", None))
        elif self._target is not None and answer.value != self._target:
            expected, found = (self._options.position_m(steps) for steps in (self._target, answer.value))
            self._abort()
            raise MotorError(
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
        status = OperationStatus(status_.value)
        self.note(
            PositionerState(
                t_ns=position.t_ns,
                position=self._options.position_m(position.value),
                target=math.nan if self._target is None else self._options.position_m(self._target),
                current_a=current.value * self._options.current_unit_a if _says_number(current.line) else math.nan,
                problem=", ".join(_name(bit) for bit in _PROBLEMS if status & bit),
            )
        )
        if status & _FAULTS or self._exchange.fault:
            self._fault(status)
        else:
            self._in_fault = False
        self._exchange.fault = False
        move = self._move
        if move is None or not move.started:
            return
        if status & OperationStatus.POSITION_ATTAINED:
            self._move = None
        elif self.clock() > move.due_ns:
            self._abort()
            limited = " at its current limit" if status & OperationStatus.CURRENT_LIMITATION else ""
            raise MotorError(
                f"The motor stands at {self.position:g} m{limited} and has not reached "
                f"{self._options.position_m(move.target):g} m within {move.seconds:.2f} s.",
                hint="Let it retreat, and see what is in its way.",
            )

    def _fault(self, status: OperationStatus) -> None:
        """Take a fault for a fact, once: it is raised by the next update."""
        if self._in_fault:
            return
        self._in_fault, self.enabled = True, False
        self._counts["faults"] += 1
        self._abort()
        names = ", ".join(_name(bit) for bit in _FAULTS if status & bit)
        error = MotorError(
            f"The motor's drive reports a fault: {names or 'it does not say which'}.",
            hint="The motor may be without power. Clear the cause, then enable it again.",
        )
        self._problem = self._problem or error


def _says_number(line: Line | None) -> bool:
    return line is not None and line.kind is Kind.VALUE


def _name(bit: OperationStatus) -> str:
    return (bit.name or "").lower().replace("_", " ")
