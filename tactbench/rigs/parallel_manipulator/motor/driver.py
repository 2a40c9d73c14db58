"""Driver of the linear motor on a Faulhaber drive: set-up, homing, moves, retreat, polling. Positions are in metres."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace

from tactbench.plugin.devices import (
    HOMING_S,
    DriverSettings,
    NotReadyError,
    Positioner,
    PositionerError,
    PositionerFacts,
    PositionerSilentError,
    PositionerState,
)
from tactbench.rigs.parallel_manipulator.motor.codec import (
    Configuration,
    FaulhaberOptions,
    Line,
    OperationStatus,
    encode,
    line_time_s,
)
from tactbench.rigs.parallel_manipulator.motor.exchange import Answer, Exchange

CORRIDOR_M = 0.2e-3
"""Largest distance [m] of target and position when the motor is switched on, and of position and `home_m` after homing
(assumed)."""
LAG_S = 10e-3
"""Time from the receipt of a command by the drive to the motor's braking [s] (assumed)."""
LONGEST_AHEAD = 24
"""Largest number of bytes before a retreat: query and move, `TPOS`, `SP10000`, `LA-12345`, `M` and CRs (derived)."""
TRIES = 5
"""Number of answers among which two successive ones must agree (assumed: damaged lines are rare)."""
STANDING_NS = 20_000_000
"""Period of the status polls of a motor at rest [ns]; line and host are idle in between (assumed)."""

_FAULTS = OperationStatus.OVERVOLTAGE | OperationStatus.OVERTEMPERATURE
_PROBLEMS = _FAULTS | OperationStatus.CURRENT_LIMITATION | OperationStatus.DEVIATION_ERROR

_ENDS = ("GPL", "GNL")
"""Queries of the ends of travel, which are set by homing."""


def retreat_command(options: FaulhaberOptions) -> bytes:
    """Return the bytes of a retreat, the same at any position; without a place of retreat, the bytes of a halt.

    Raises RigError if the drive does not support the speed.
    """
    if options.retreat_m is None or options.retreat_speed_m_s is None:
        return encode("V", 0)
    speed, place = options.speed(options.retreat_speed_m_s), options.increments(options.retreat_m)
    return encode("SP", speed) + encode("LA", place) + encode("M")


class FaulhaberDriver(Positioner):
    """Driver of a linear motor on a Faulhaber drive of the 300x RS generation.

    While the motor moves, position and status are polled as fast as the line permits, some 40 times a second at 9600
    baud, 250 times at 115200; at rest 50 times. The time of a state is the receipt of the first byte of the
    position's answer; the drive has measured it a few bytes earlier. Every setting, limit and target is read back:
    the protocol has no checksum.
    """

    device = "faulhaber"
    options_kind = FaulhaberOptions
    options: FaulhaberOptions

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self._settings = _stated(self.options)
        self._exchange = Exchange(self.link, settings.clock, self.options.baud)
        self._watching = self._confirmed = self._earlier = False
        """Flags: motor is polled; drive has confirmed the target; next answer may date from before the move."""
        self._polled_ns = 0
        self._position: Line | None = None
        """Position whose status is queried next."""
        self._usual = 0
        """Usual speed of moves in the drive's units."""
        self._speed: int | None = None
        """Present speed setting of the drive, in its units; None: not known."""

    @classmethod
    def facts_of(cls, options: FaulhaberOptions) -> PositionerFacts:
        """Return the axis' properties, with the drive's increment, and the latency of line and motor.

        Raises RigError for a setting that the drive does not support.
        """
        _stated(options)
        bytes_ahead = LONGEST_AHEAD + len(retreat_command(options))
        return replace(
            super().facts_of(options),
            resolution=options.increment_m,
            stop_latency_s=line_time_s(bytes_ahead, options.baud) + LAG_S,
            homes_here=options.homing == "here",
        )

    # The life of a device ---------------------------------------------------------------------------------------------

    @property
    def counts(self) -> Mapping[str, int]:
        """Event counts of :class:`Exchange` that are not 0."""
        return +self._exchange.counts

    def identify(self) -> Mapping[str, str]:
        """Return the drive's firmware."""
        return {"firmware": self._exchange.greet()}

    def start(self) -> None:
        """Make the drive report refusals, set and read back speeds and currents, and begin polling the motor."""
        if not self._exchange.version:
            self._exchange.greet()
        # No source states the answer to ANSW itself.
        self._exchange.send("ANSW", 2)
        self._exchange.quiet()
        self._exchange.send("SOR", 0)
        if "GPC" in self._settings:
            # The continuous current may not be above the peak; a lower one is the motor's own.
            self._settings["GCC"] = ("LCC", min(self._settings["GPC"][1], self._sure("GCC")))
        for query, setting in self._settings.items():
            if query not in _ENDS:
                self._keep(query, *setting)
        self._usual = self._speed = self._sure("GSP")
        self.enabled = self._has(Configuration.POWER_STAGE)
        if self.enabled:
            self.locate()
        self._watching = True

    def stop(self) -> None:
        """Stop polling. The motor completes its move, and holds."""
        self._watching = False
        super().stop()

    # Power and place --------------------------------------------------------------------------------------------------

    def enable(self) -> None:
        """Give the motor power; it holds its place. If its target is elsewhere, power is switched off again."""
        self._exchange.send("EN")
        self.enabled = self._has(Configuration.POWER_STAGE)
        if not self.enabled:
            raise PositionerError("The motor's drive was enabled and has no power.", hint="Check its power supply.")
        place_m, target_m = self.locate()
        if abs(place_m - target_m) > CORRIDOR_M:
            self.disable()
            raise PositionerError(
                f"The motor is at {place_m:g} m and would move to {target_m:g} m; its power was switched off.",
                hint="Home it anew.",
            )

    def disable(self) -> None:
        """Switch the motor's power off; it can be pushed then, and falls unless something holds it."""
        self._forget()
        self._exchange.send("DI")
        self.enabled = self._has(Configuration.POWER_STAGE)
        if self.enabled:
            raise PositionerError("The motor's drive was disabled and still has power.", hint="Cut its power supply.")

    def locate(self) -> tuple[float, float]:
        """Query target and position, each until two successive answers agree; return position and target [m]."""
        self._goal, place_m = (self.options.position_m(self._sure(query)) for query in ("TPOS", "POS"))
        self.note(PositionerState(self.clock(), place_m, self._goal))
        return place_m, self._goal

    def find_home(self) -> bool:
        """Return True if the drive has kept power and the ends of travel set by homing; then its zero is the same.

        A drive that was without supply has kept neither (assumed: its power stage is off until EN).
        """
        self.homed = (
            _ENDS[0] in self._settings
            and self._has(Configuration.POWER_STAGE | Configuration.POSITION_LIMITS)
            and all(self._sure(query) == self._settings[query][1] for query in _ENDS)
        )
        if self.homed:
            self.locate()
        return self.homed

    def home(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Find the origin of positions, as the options state, and set the ends of travel.

        The motor runs against an end stop for a minute at most; homed ``here`` it does not move. The drive gets
        its usual current limits again once the origin is found.
        """
        if self.moving or _ENDS[0] not in self._settings:
            raise NotReadyError(
                "The motor is moving, or its ends of travel are not stated.",
                hint="Wait for the end of the move, or give lower_m and upper_m in the rig file.",
            )
        options, self.homed = self.options, False
        home = options.increments(options.home_m)
        self._exchange.send("APL", 0)
        if options.homing == "end-stop":
            self.enable()
            self._against_stop(stop)
        self._exchange.send("HO", home)
        place_m, _ = self.locate()
        if abs(place_m - options.home_m) > CORRIDOR_M:
            raise PositionerError(f"The motor reports {place_m:g} m after homing to {options.home_m:g} m.")
        for query in _ENDS:
            self._keep(query, *self._settings[query])
        self._exchange.send("APL", 1)
        self._check_limits()
        self.homed = True
        if self.enabled:
            # Position control again, from a target that is known, within the ends of travel.
            upper, lower = (self._settings[query][1] for query in _ENDS)
            self._go(min(max(home, lower), upper), self._usual)
            self.finish(stop)

    def confirm(self) -> None:
        """Read back all settings and ends of travel of the options; raises PositionerError if a value differs."""
        for query, setting in self._settings.items():
            # The speed of the last retreat may still be set.
            (self._keep if query == "GSP" else self._same)(query, *setting)
        self._speed = None
        self._check_limits()

    def _check_limits(self) -> None:
        if not self._has(Configuration.POSITION_LIMITS):
            raise PositionerError("The motor's drive has lost its ends of travel.", hint="Home it anew.")

    def _against_stop(self, stop: Callable[[], bool]) -> None:
        """Run at the homing speed and current until the motor stands at its current limit in two successive polls."""
        little = self.options.current(self.options.homing_current_a)
        before = {"GPC": ("LPC", self._sure("GPC")), "GCC": ("LCC", self._sure("GCC"))}
        for query, (command, argument) in before.items():
            self._keep(query, command, min(little, argument))
        until_ns, times = self.clock() + round(1e9 * HOMING_S), 0
        try:
            self._exchange.send("V", self.options.speed(self.options.homing_speed_m_s))
            while times < 2:
                status = OperationStatus(int(self._exchange.ask("OST").text))
                limited = OperationStatus.CURRENT_LIMITATION in status and self._exchange.ask("GN").text == "0"
                times = times + 1 if limited else 0
                for ended, why in (
                    (status & _FAULTS, "the drive reports a fault"),
                    (stop(), "homing was stopped"),
                    (self.clock() > until_ns, f"not reached within {HOMING_S:g} s"),
                ):
                    if ended:
                        raise PositionerError(
                            f"The motor did not find its end stop: {why}.",
                            hint="Check homing_speed_m_s and homing_current_a in the rig file.",
                        )
        finally:
            self._exchange.send("V", 0)
        for query, setting in before.items():
            self._keep(query, *setting)

    # Motion -----------------------------------------------------------------------------------------------------------

    def move_to(self, position: float, speed: float | None = None) -> float:
        """Begin a move to the increment nearest to a position; the speed is rounded down."""
        self.check_move(position)
        return self._go(self.options.increments(position), self._units(speed))

    def _units(self, speed: float | None) -> int:
        return self._usual if speed is None else self.options.speed(speed)

    def halt(self) -> None:
        """Begin a move to the position read last, whatever is under way: the motor brakes and holds there.

        If the position is not known, the speed is set to 0 instead.
        """
        if self.state is None or not self.homed:
            self._exchange.send("V", 0)
            return
        self._go(self.options.increments(self.position), self._speed or self._usual)

    def retreat(self) -> None:
        """Begin a move to the place away from the sensor, whatever is under way; halt if it is not stated or not homed.

        If the drive does not answer, `update` raises PositionerSilentError: call this again; the bytes sent are the
        same at any position.
        """
        if math.isnan(self.facts.retreat) or not self.homed:
            self.halt()
            return
        self._speed = None
        self._go(self.options.increments(self.facts.retreat), self._units(self.options.retreat_speed_m_s))

    def _go(self, target: int, speed: int) -> float:
        """Send a move at once, without waiting for an outstanding answer; return its target [m]."""
        target_m = self.options.position_m(target)
        self.begin(target_m, max(1, speed) * self.options.speed_unit_m_s)
        self._confirmed, self._earlier, self._position = False, not self._exchange.ready, None
        if speed != self._speed:
            self._speed = speed
            self._exchange.send("SP", speed)
        self._exchange.send("LA", target)
        self._exchange.send("M")
        return target_m

    def _forget(self) -> None:
        """Treat target and speed as unknown: the last command may or may not have been carried out."""
        self._moving, self._goal, self._speed = False, math.nan, None
        self.state = self.state and replace(self.state, target=math.nan)

    def rescue(self, within_s: float | None) -> float:
        """Retreat or halt a drive set up by another process, whose positions are still valid; see `Positioner`.

        An incomplete command that may be on the line is ended first.
        """
        command = encode("V", 0) if within_s is None else retreat_command(self.options)
        self.link.write(b"\r" + command)
        if within_s is None or math.isnan(self.facts.retreat):
            return math.nan
        self._exchange.quiet()
        with suppress(PositionerError):
            self.locate()
        self._watching = True
        return super().rescue(within_s)

    # Settings ---------------------------------------------------------------------------------------------------------

    def _sure(self, query: str) -> int:
        """Return the number on which two successive answers agree: the protocol has no checksum."""
        self._position = before = None
        for _ in range(TRIES):
            value = int(self._exchange.ask(query).text)
            if value == before:
                return value
            before = value
        raise PositionerError(f"Successive answers to {query} always differ.", hint="Let the motor come to rest.")

    def _has(self, bits: Configuration) -> bool:
        return self._sure("CST") & bits == bits

    def _keep(self, query: str, command: str, argument: int) -> None:
        """Set a number and read it back; repeat this once if a digit was damaged on the line."""
        self._exchange.send(command, argument)
        if self._sure(query) != argument:
            self._exchange.send(command, argument)
            self._same(query, command, argument)

    def _same(self, query: str, command: str, argument: int) -> None:
        if (found := self._sure(query)) != argument:
            raise PositionerError(
                f"The drive has {query} {found} after {command}{argument} was set.",
                hint="Check if the drive lost power or another program set it; compare the option with its manual.",
            )

    # Polling ----------------------------------------------------------------------------------------------------------

    def update(self, timeout_s: float = 0.0) -> None:
        """Send the next query, read answers, waiting at most `timeout_s` for a byte; raise an error if it is wrong."""
        self._poll()
        if self._exchange.ready and self._watching:  # it stands: until the next poll
            timeout_s = min(timeout_s, max(0.0, 1e-9 * (self._polled_ns + STANDING_NS - self.clock())))
        try:
            if answer := self._exchange.pump(timeout_s):
                self._take(answer)
        except PositionerError:
            self._forget()
            raise
        self._poll()

    def _poll(self) -> None:
        if not self._exchange.ready:
            return
        if self.moving and not self._confirmed:
            self._exchange.query("TPOS")
        elif self._watching and self._position is not None:
            self._exchange.query("OST")
        elif self._watching and (self.moving or self.clock() >= self._polled_ns + STANDING_NS):
            self._polled_ns = self.clock()
            self._exchange.query("POS")

    def _take(self, answer: Answer) -> None:
        """Process an answer that no caller waits for; raises an error if it is wrong."""
        line, earlier, self._earlier = answer.line, self._earlier, False
        position, self._position = self._position, None
        if line is None and self.moving and not self._confirmed:
            raise PositionerSilentError(
                "The motor's drive did not answer after a move was sent; the move may have been made.",
                hint="Check the cable; read the position before the next move.",
            )
        if earlier or line is None:
            return
        if answer.query == "TPOS":
            if int(line.text) != self.options.increments(self._goal):
                raise PositionerError(
                    f"The drive has the target {self.options.position_m(int(line.text)):g} m, not {self._goal:g} m.",
                    hint="A byte was damaged on the line: let the motor retreat, and check the cable.",
                )
            self._confirmed = True
        elif answer.query == "POS":
            self._position = line
        elif position is not None:
            self._note_status(position, OperationStatus(int(line.text)))

    def _note_status(self, position: Line, status: OperationStatus) -> None:
        """Store position and status; a move has ended if the drive reports its confirmed target as reached."""
        problem = ", ".join(str(bit.name).lower().replace("_", " ") for bit in status & _PROBLEMS)
        if status & _FAULTS or self._exchange.fault:
            self.enabled = self._exchange.fault = False
            problem = problem or "a fault"
        self.see(
            position.t_ns,
            self.options.position_m(int(position.text)),
            idle=self._confirmed and OperationStatus.POSITION_ATTAINED in status,
            target=self._goal,
            problem=problem,
        )


def _stated(options: FaulhaberOptions) -> dict[str, tuple[str, int]]:
    """Return command and argument of each stated setting, by the query that reads the setting back.

    Raises RigError if the drive cannot be set to a stated value.
    """
    stated = {
        "GSP": ("SP", options.speed, options.speed_m_s),
        "GAC": ("AC", options.acceleration, options.acceleration_m_s2),
        "GDEC": ("DEC", options.acceleration, options.acceleration_m_s2),
        "GCORRIDOR": ("CORRIDOR", lambda corridor_m: max(1, options.increments(corridor_m)), options.corridor_m),
        "GPC": ("LPC", options.current, options.current_limit_a),
        "GPL": ("LL", options.increments, options.upper_m),
        "GNL": ("LL", options.increments, options.lower_m),
    }
    return {query: (command, of(value)) for query, (command, of, value) in stated.items() if value is not None}
