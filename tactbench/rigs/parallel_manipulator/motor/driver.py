"""The linear motor on a Faulhaber drive: set up, homed, moved, retreated, and watched. Positions are in metres."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from tactbench.plugin.devices import (
    HOMING_S,
    DriverSettings,
    NotReadyError,
    Positioner,
    PositionerError,
    PositionerFacts,
    PositionerState,
)
from tactbench.rigs.parallel_manipulator.motor.codec import (
    ACKNOWLEDGED,
    Configuration,
    OperationStatus,
    encode,
    line_time_s,
)
from tactbench.rigs.parallel_manipulator.motor.exchange import Answer, Exchange, MotorRefusalError
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions

CORRIDOR_M = 0.2e-3
"""How far target and position may be apart when the motor is switched on, and place and its name when it was homed
(assumed)."""
LAG_S = 10e-3
"""From the drive's having a command to the motor's braking (assumed)."""
LONGEST_AHEAD = 24
"""Bytes that may be ahead of a retreat: a question and a move, `TPOS`, `SP10000`, `LA-12345`, `M` and CRs (derived)."""
TRIES = 5
"""Answers of which two in a row must agree (assumed: damaged lines are rare)."""
AGAIN_S = 0.25
"""After which a rescue is sent once more where the motor does not come nearer (assumed)."""

STANDING_NS = 20_000_000
"""How often a motor that stands is looked at: its line, guard and host have time for others then (assumed)."""

_FAULTS = OperationStatus.OVERVOLTAGE | OperationStatus.OVERTEMPERATURE
_PROBLEMS = _FAULTS | OperationStatus.CURRENT_LIMITATION | OperationStatus.DEVIATION_ERROR
_WATCHED = ("POS", "GRC", "OST")
_CHANGED = "Was it without power, or set by another program? Check the option against the drive's manual."


@dataclass(eq=False)
class _Move:
    target: int
    """Increments."""
    seconds: float
    """It takes at most."""
    due_ns: int | None = None
    """When it must have ended; None: the drive has not acknowledged its start."""


def retreat_command(options: FaulhaberOptions) -> bytes:
    """Return the bytes of a retreat, the same wherever the motor is; without a place to retreat to, those of standing.

    Raises RigError if the drive does not have the speed.
    """
    if options.retreat_m is None or options.retreat_speed_m_s is None:
        return encode("V", 0)
    speed, place = options.speed(options.retreat_speed_m_s), options.increments(options.retreat_m)
    return encode("SP", speed) + encode("LA", place) + encode("M")


class FaulhaberDriver(Positioner):
    """A linear motor on a Faulhaber drive of the 300x RS generation.

    Position and current are polled as fast as the line allows while it moves, some 30 to 40 times a second at 9600 baud
    and 200 at 115200, and 50 times where it stands. The time of a state is when the first byte of the position's answer
    was in the host; the drive has read it a few bytes of line earlier. Every setting, limit and target is read back:
    the protocol has no checksum.
    """

    device = "faulhaber"
    options_kind = FaulhaberOptions

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self._options: FaulhaberOptions = self.options
        self._settings, self._limits = _required(self._options)
        self._exchange = Exchange(self.link, settings.clock, self._options.baud)
        self._identified = ""
        self._watching = self._confirming = False
        self._turn = self._looked_ns = 0
        self._latest: dict[str, Answer] = {}
        self._move: _Move | None = None
        self._target: int | None = None
        self._usual = 0
        """Speed of moves in the drive's units."""
        self._speed: int | None = None
        """That the drive has; None: not known."""

    @classmethod
    def facts_of(cls, options: FaulhaberOptions) -> PositionerFacts:
        """Return the facts, with the drive's increment, and the line's and the motor's latency.

        Raises
        ------
        RigError
            For a setting that the drive does not have.
        """
        _required(options)
        bytes_ahead = LONGEST_AHEAD + len(retreat_command(options))
        latency_s = line_time_s(bytes_ahead, options.baud) + LAG_S
        facts = replace(super().facts_of(options), resolution=options.increment_m, stop_latency_s=latency_s)
        return replace(facts, homes_here=options.homing == "here")

    # The life of a device ---------------------------------------------------------------------------------------------

    @property
    def counts(self) -> Mapping[str, int]:
        """Those of :class:`Exchange`; but for those at 0."""
        return {name: count for name, count in self._exchange.counts.items() if count}

    def identify(self) -> Mapping[str, str]:
        """Return firmware, and model and serial number where the drive has them."""
        self._identified = self._exchange.greet()
        found = {"firmware": self._identified}
        for query, name in (("GTYP", "model"), ("GSER", "serial")):
            with suppress(MotorRefusalError):
                found[name] = self._ask(query).checked().text
        return found

    def start(self) -> None:
        """Let the drive acknowledge commands, set speeds and currents, read them back, and watch the motor."""
        if not self._identified:
            self._identified = self._exchange.greet()
        # What is answered to ANSW itself is in no source.
        self._exchange.send("ANSW", 2)
        self._exchange.quiet()
        if not self._configuration() & Configuration.ACKNOWLEDGES:
            raise PositionerError("The motor's drive does not acknowledge commands after ANSW2.")
        self._ask("SOR", 0)
        for setting in self._settings:
            self._keep(*setting)
        if (most := self._largest_current()) is not None and self._sure("GCC") > most:
            self._keep("LCC", most, "GCC")
        self._usual = self._speed = self._sure("GSP")
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
        self.enabled = bool(self._configuration() & Configuration.POWER_STAGE)
        if not self.enabled:
            raise PositionerError("The motor's drive was enabled and has no power.", hint="Check its supply.")
        place_m, target_m = self.locate()
        if abs(place_m - target_m) > CORRIDOR_M:
            self.disable()
            raise PositionerError(
                f"The motor was to hold its place at {place_m:g} m, and its target is {target_m:g} m; it is without "
                "power again.",
                hint="Home it anew.",
            )

    def disable(self) -> None:
        """Take the motor's power; it can be pushed then, and falls where nothing holds it."""
        self._forget()
        self._ask("DI")
        self.enabled = False

    def locate(self) -> tuple[float, float]:
        """Ask for place and target, each until two answers are the same, and return them [m]."""
        self._target = self._sure("TPOS")
        place_m, target_m = (self._options.position_m(steps) for steps in (self._sure("POS"), self._target))
        self.note(PositionerState(self.clock(), place_m, target_m))
        return place_m, target_m

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

        The motor runs against an end stop for a minute at most; homed ``here`` it does not move. What the options say
        of current is that of the drive again once the place is found.
        """
        if self.moving:
            raise NotReadyError("The motor is moving.", hint="Wait for the end of its move, or let it retreat.")
        options, self.homed = self._options, False
        home = options.increments(options.home_m)
        self._ask("APL", 0)
        if options.homing == "end-stop":
            self.enable()
            self._against_stop(stop)
        self._ask("HO", home)
        place_m, _ = self.locate()
        if abs(place_m - options.home_m) > CORRIDOR_M:
            raise PositionerError(f"The motor's place was to be called {options.home_m:g} m, and is {place_m:g} m.")
        for setting in self._limits:
            self._keep(*setting)
        if self._limits:
            self._ask("APL", 1)
            self._holds_limits()
        self.homed = True
        if self.enabled and self._limits:
            # Position control again, from a target that is known, within the ends of travel.
            (_, upper, _), (_, lower, _) = self._limits
            self._go(min(max(home, lower), upper), self._usual)
            while self.moving:
                self.update(self._exchange.answer_s)

    def confirm(self) -> None:
        """Read back all settings and the ends of travel that options state; raises PositionerError if one differs."""
        for setting in (*self._settings, *self._limits):
            if setting[0] == "SP":  # the speed of the last retreat may stand there
                self._keep(*setting)
                self._speed = setting[1]
            else:
                self._same(*setting)
        if (most := self._largest_current()) is not None and (found := self._sure("GCC")) > most:
            raise PositionerError(
                f"The motor's drive has GCC {found}, above the peak current of {most}.", hint=_CHANGED
            )
        if self._limits:
            self._holds_limits()

    def _largest_current(self) -> int | None:
        """Return the limit of peak current in the drive's units, above which its continuous one may not be either."""
        return next((argument for command, argument, _ in self._settings if command == "LPC"), None)

    def _holds_limits(self) -> None:
        if not self._configuration() & Configuration.POSITION_LIMITS:
            raise PositionerError("The motor's drive does not hold the ends of travel.", hint="Home it anew.")

    def _against_stop(self, stop: Callable[[], bool]) -> None:
        """Run at a speed and with little current until the motor stands at its current limit, twice in a row."""
        little = self._options.current(self._options.homing_current_a)
        before = [("LPC", self._sure("GPC"), "GPC"), ("LCC", self._sure("GCC"), "GCC")]
        for command, argument, query in before:
            self._keep(command, min(little, argument), query)
        until_ns, times = self.clock() + round(1e9 * HOMING_S), 0
        try:
            self._ask("V", self._options.speed(self._options.homing_speed_m_s))
            while times < 2:
                status = OperationStatus(self._ask("OST").value)
                if status & _FAULTS:
                    raise PositionerError("The motor's drive reports a fault while it looks for its place.")
                limited = bool(status & OperationStatus.CURRENT_LIMITATION) and self._ask("GN").value == 0
                times = times + 1 if limited else 0
                if stop():
                    raise PositionerError("The motor was told to stand while it looked for an end stop.")
                if self.clock() > until_ns:
                    raise PositionerError(
                        f"The motor has not found an end stop within {HOMING_S:g} s.",
                        hint="Check homing_speed_m_s and homing_current_a in the rig file.",
                    )
        finally:
            self._ask("V", 0)
        for setting in before:
            self._keep(*setting)

    # Motion -----------------------------------------------------------------------------------------------------------

    @property
    def moving(self) -> bool:
        """Whether a move is under way, by what is known now."""
        return self._move is not None

    def move_to(self, position: float, speed: float | None = None) -> float:
        """Begin to move to a position, to the nearest increment; the speed is rounded down."""
        self.check_move(position)
        units = self._usual if speed is None else self._options.speed(speed)
        return self._go(self._options.increments(position), units)

    def halt(self) -> None:
        """Begin to move to the position that was last read, whatever is under way: it brakes and holds there.

        Where its place is not known it is told a speed of 0.
        """
        if self.state is None or not self.homed:
            self._exchange.send("V", 0)
            return
        self._go(self._options.increments(self.position), self._speed or self._usual)

    def retreat(self) -> None:
        """Begin to move to the place away from the sensor, whatever is under way; without one it halts.

        Where it is not answered, `update` raises PositionerSilentError: call this again, it is the same wherever the
        motor is.
        """
        if math.isnan(self.facts.retreat):
            self.halt()
            return
        if not self.homed:
            raise NotReadyError("The motor has no place to retreat to.", hint="Home it.")
        self._speed = None
        speed = self._options.retreat_speed_m_s
        units = self._usual if speed is None else self._options.speed(speed)
        self._go(self._options.increments(self.facts.retreat), units)

    def _go(self, target: int, speed: int) -> float:
        """Send a move at once, without waiting for answers that are out; return where to [m]."""
        exchange, target_m = self._exchange, self._options.position_m(target)
        self._fastest = speed_m_s = max(1, speed) * self._options.speed_unit_m_s
        seconds = self.facts.seconds(target_m - self.position, speed_m_s) + 4.0 * exchange.answer_s
        self._move = move = _Move(target, seconds)
        if speed != self._speed:
            self._speed = speed
            exchange.send("SP", speed, move)
        exchange.send("LA", target, move)
        exchange.send("M", None, move)
        return target_m

    def _forget(self) -> None:
        self._move, self._target, self._confirming = None, None, False
        self.state = self.state and replace(self.state, target=math.nan)

    def rescue(self, within_s: float | None) -> float:
        """Retreat, or stand, with a drive that another process had; see `Positioner`.

        The drive keeps its positions; nothing else is assumed of what stands on the line. Half a command that may stand
        there is ended first, so that the first answer may be a refusal.
        """
        target_m = self.facts.retreat
        if within_s is None or math.isnan(target_m):
            self.link.write(b"\r" + encode("V", 0))
            return math.nan
        until_ns = self.clock() + round(1e9 * within_s)
        sent_ns, there, place_m, nearest_m = -math.inf, 0, math.nan, math.inf
        while self.clock() < until_ns:
            if not there and self.clock() - sent_ns > 1e9 * AGAIN_S:
                self.link.write(b"\r" + retreat_command(self._options))
                self._exchange.quiet()
                sent_ns = self.clock()
            with suppress(PositionerError):
                place_m = self._options.position_m(self._ask("POS").value)
                away_m = abs(place_m - target_m)
                there = there + 1 if away_m <= self.facts.near else 0
                if there == 2:  # One could be the late answer to another question.
                    return place_m
                if away_m < nearest_m:
                    nearest_m, sent_ns = away_m, self.clock()
        where = "does not say where it is" if math.isnan(place_m) else f"is at {place_m:g} m"
        raise PositionerError(
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
            if found[0].line is not None or name in ACKNOWLEDGED:
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
        raise PositionerError(
            f"The motor's drive gives no two equal answers in a row to {query}.", hint="Is it at rest?"
        )

    def _configuration(self) -> Configuration:
        return Configuration(self._sure("CST"))

    def _keep(self, command: str, argument: int, query: str) -> None:
        self._ask(command, argument)
        if self._sure(query) != argument:  # a digit may have been damaged on its way
            self._ask(command, argument)
            self._same(command, argument, query)

    def _same(self, command: str, argument: int, query: str) -> None:
        if (found := self._sure(query)) != argument:
            raise PositionerError(
                f"The motor's drive has {query} {found} where {command}{argument} was set.",
                hint=_CHANGED,
            )

    # What comes and goes ----------------------------------------------------------------------------------------------

    def update(self, timeout_s: float = 0.0) -> None:
        """Send what is next, take what comes, waiting at most `timeout_s` for a byte of it; raise what is wrong."""
        self._ask_next()
        if self._exchange.ready and self._watching:  # it stands: until the next look
            timeout_s = min(timeout_s, max(0.0, 1e-9 * (self._looked_ns + STANDING_NS - self.clock())))
        try:
            for answer in self._exchange.pump(timeout_s):
                self._take(answer)
        except PositionerError:
            self._forget()
            self._speed = None
            raise
        self._ask_next()

    def _ask_next(self) -> None:
        if not self._exchange.ready:
            return
        if self._confirming:
            self._exchange.send("TPOS")
        elif self._watching and (self._turn or self.moving or self.clock() >= self._looked_ns + STANDING_NS):
            if self._turn == 0:
                self._looked_ns = self.clock()
            self._exchange.send(_WATCHED[self._turn])

    def _take(self, answer: Answer) -> None:
        """Take what became of a command that nobody waits for; raises what is wrong."""
        move = self._move
        if answer.name in _WATCHED:
            # Where one did not come they are asked again from the start: they belong together.
            self._turn = 0 if answer.line is None else (self._turn + 1) % len(_WATCHED)
            self._latest[answer.name] = answer
            if self._turn == 0 and answer.line is not None:
                self._see()
        elif answer.name == "TPOS":
            self._check_target(answer)
        elif move is not None and answer.of is move:
            answer.checked()
            if answer.name == "M":
                move.due_ns = self.clock() + round(1e9 * move.seconds)
                self._target, self._confirming = move.target, True

    def _check_target(self, answer: Answer) -> None:
        if answer.line is None or self._target is None:
            return
        self._confirming = False
        if answer.value != self._target:
            expected, found = (self._options.position_m(steps) for steps in (self._target, answer.value))
            raise PositionerError(
                f"The motor's target is {found:g} m, and {expected:g} m was asked for.",
                hint="A byte was damaged on the line: let it retreat, and check the cable.",
            )

    def _see(self) -> None:
        """Note position, current and status; end the move, or raise where it does not end."""
        position, current, status_ = (self._latest[name] for name in _WATCHED)
        status, options, move = OperationStatus(status_.value), self._options, self._move
        problem = ", ".join(str(bit.name).lower().replace("_", " ") for bit in status & _PROBLEMS)
        if status & _FAULTS or self._exchange.fault:
            self.enabled, self._exchange.fault = False, False
            problem = problem or "a fault"
        self.note(
            PositionerState(
                t_ns=position.checked().t_ns,
                position=options.position_m(position.value),
                target=math.nan if self._target is None else options.position_m(self._target),
                current_a=current.value * options.current_unit_a,
                problem=problem,
            )
        )
        if move is None or move.due_ns is None:
            return
        if status & OperationStatus.POSITION_ATTAINED:
            self._move = None
        elif self.clock() > move.due_ns:
            raise PositionerError(
                f"The motor stands at {self.position:g} m{f' ({problem})' if problem else ''} and has not reached "
                f"{options.position_m(move.target):g} m within {move.seconds:.2f} s.",
                hint="Let it retreat, and see what is in its way.",
            )


_Setting = tuple[str, int, str]
"""Command, argument, and the query that reads it back."""


def _required(options: FaulhaberOptions) -> tuple[list[_Setting], list[_Setting]]:
    """Return the settings and the ends of travel that the options state; raises RigError if the drive has no such."""
    stated = (
        ("SP", options.speed, options.speed_m_s, "GSP"),
        ("AC", options.acceleration, options.acceleration_m_s2, "GAC"),
        ("DEC", options.acceleration, options.acceleration_m_s2, "GDEC"),
        ("CORRIDOR", lambda corridor_m: max(1, options.increments(corridor_m)), options.corridor_m, "GCORRIDOR"),
        ("LPC", options.current, options.current_limit_a, "GPC"),
        ("LL", options.increments, options.upper_m, "GPL"),
        ("LL", options.increments, options.lower_m, "GNL"),
    )
    found = [(command, of(value), query) for command, of, value, query in stated if value is not None]
    return [one for one in found if one[0] != "LL"], [one for one in found if one[0] == "LL"]
