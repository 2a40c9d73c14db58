"""Emulator of the motor, its drive and its line: answers bytes with bytes at times passed in, without input or output.

Behaviour without a public source is assumed, as marked in the code. Only the commands sent by the driver are modelled.
Quasi-static (assumed): the motor is where the reference is, as far as the load permits at the current limit, and
accelerates as it brakes, by DEC. Lag, mass, friction and heat are left out; without power it stands. Positions in
metres are those of the motor's driver after homing.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Sent,
    fault_concerns,
    read_options,
)
from tactbench.rigs.parallel_manipulator.motor.codec import (
    INVALID_PARAMETER,
    NOT_AVAILABLE,
    OK,
    OVERTEMPERATURE,
    UNKNOWN_COMMAND,
    Command,
    CommandReader,
    Configuration,
    FaulhaberOptions,
    OperationStatus,
    line_time_s,
)

Load = Callable[[float], float]
"""Function from the position [m] to the force against positive motion [N], which is not negative and does not fall."""

FORCE_CONSTANT_N_A = 6.5
"""Force constant of an emulated motor [N/A]; it, the currents at power-on and the stops have the size of those of small
tubular linear motors (assumed)."""
PEAK_CURRENT_A, CONTINUOUS_CURRENT_A = 1.6, 1.0
REACH_M = 10e-3
"""Distance of the mechanical end stops from the place at power-on [m], if the options state no ends of travel."""
BEYOND_M = 2e-3
"""Distance of an emulated motor's end stops from the ends of travel in its options [m] (assumed)."""
ANSWER_S = 1e-3
"""Time from the end of a command to the start of its answer [s] (assumed)."""
TICK_S = 1e-3
"""Period of the emulator's events while the motor moves [s]."""

_SIGNED = ("LA", "HO", "LL", "V")
"""Commands whose number may be negative."""
_READ_BACK = {
    "GSP": "SP", "GAC": "AC", "GDEC": "DEC", "GPC": "LPC", "GCC": "LCC", "GCORRIDOR": "CORRIDOR", "GPL": "GPL",
    "GNL": "GNL",
}  # fmt: skip


class Motion:
    """Motion in pieces of constant acceleration, from a given place [m], speed [m/s] and time [s]."""

    def __init__(self, at_s: float, place_m: float, speed_m_s: float = 0.0) -> None:
        self._pieces = [(at_s, place_m, speed_m_s, 0.0)]

    @property
    def end_s(self) -> float:
        """Time at which the last piece begins [s], at constant speed."""
        return self._pieces[-1][0]

    def at(self, t_s: float) -> tuple[float, float]:
        """Return place [m] and speed [m/s] at a time [s]."""
        began_s, place, speed, acceleration = next(
            (piece for piece in reversed(self._pieces) if piece[0] <= t_s), self._pieces[0]
        )
        since_s = max(0.0, t_s - began_s)
        return place + since_s * (speed + 0.5 * acceleration * since_s), speed + acceleration * since_s

    def _extend(self, seconds: float, acceleration: float) -> None:
        began_s, place, speed, _ = self._pieces.pop()
        self._pieces.append((began_s, place, speed, acceleration))
        self._pieces.append((began_s + seconds, *self.at(began_s + seconds), 0.0))

    def to_speed(self, speed: float, rate: float) -> None:
        """Append a change to a speed [m/s], at a positive acceleration [m/s^2]."""
        change = speed - self._pieces[-1][2]
        self._extend(abs(change) / rate, math.copysign(rate, change))

    def to_position(self, target_m: float, speed: float, rate: float) -> None:
        """Append braking to rest (assumed), and a move that ends at rest on a target [m]; speed and rate are positive.

        The move accelerates over half of the way at most, and brakes over the rest.
        """
        self.to_speed(0.0, rate)
        way_m = target_m - self._pieces[-1][1]
        if peak := min(speed, math.sqrt(rate * abs(way_m))):
            self.to_speed(math.copysign(peak, way_m), rate)
            self._extend(max(0.0, abs(way_m) / peak - peak / rate), 0.0)
            self.to_speed(0.0, rate)
        self._pieces[-1] = (self.end_s, target_m, 0.0, 0.0)


class Drive:
    """Model of a drive with its motor, which answers commands at any time, without encoding or a serial line.

    It begins where a motor of these options is homed `here`; else at its place of retreat, or away from the end stop.

    Parameters
    ----------
    options
        Options with the units of the drive, its home and its ends of travel.

    Attributes
    ----------
    load
        Function of the force on the motor; None: no force at any time.
    stops
        Mechanical ends of travel [m].
    settings
        Numbers by the command that sets them; those of LL are named GPL and GNL.
    now_s
        Present time [s]; set before each call.
    hot
        True if the drive is too hot: it has no power until it has cooled and is enabled again.
    """

    def __init__(self, options: FaulhaberOptions) -> None:
        self.load: Load | None = None
        self.now_s = 0.0
        self._options, towards = options, options.homes_towards()
        begin_m = options.home_m - towards * REACH_M
        if towards and options.retreat_m is not None:
            begin_m = options.retreat_m
        low, high = begin_m - REACH_M, begin_m + REACH_M
        if options.lower_m is not None and options.upper_m is not None:
            low, high = options.lower_m - BEYOND_M, options.upper_m + BEYOND_M
        self.stops = (options.home_m if towards < 0 else low, options.home_m if towards > 0 else high)
        self.settings = {  # assumed
            "SP": options.speed(0.05), "AC": options.acceleration(1.0), "DEC": options.acceleration(1.0),
            "LPC": options.current(PEAK_CURRENT_A), "LCC": options.current(CONTINUOUS_CURRENT_A),
            "GNL": 0, "GPL": 0, "CORRIDOR": 20, "APL": 0, "ANSW": 2, "SOR": 0,
        }  # fmt: skip
        self.hot = self.enabled = self._at_speed = False
        self._motion = Motion(0.0, begin_m)
        self._origin_m = self._loaded_m = self.target_m = begin_m  # assumed: the encoder is incremental

    def lose_power(self) -> None:
        """Stop and switch the power off, as after DI."""
        self._motion = Motion(self.now_s, self.position_m)
        self.enabled = False

    @property
    def position_m(self) -> float:
        """Position of the motor [m]."""
        return self._pressed()[0]

    @property
    def moving(self) -> bool:
        """True if the reference position moves, now or later, without a further command."""
        return self.now_s < self._motion.end_s or self._motion.at(self.now_s)[1] != 0.0

    def _pressed(self) -> tuple[float, bool]:
        """Return the motor's place [m], and True if its force is at the current limit."""
        reference_m = self._motion.at(self.now_s)[0]
        if not self.enabled:
            return reference_m, False
        out_m, high = self.stops
        most_n = FORCE_CONSTANT_N_A * self.settings["LPC"] * self._options.current_unit_a
        place_m = min(max(reference_m, out_m), high)
        if self.load is not None and self.load(place_m) > most_n:
            for _ in range(50):  # to the place at which load and limit are equal
                middle_m = 0.5 * (out_m + place_m)
                out_m, place_m = (middle_m, place_m) if self.load(middle_m) < most_n else (out_m, middle_m)
        return place_m, place_m != reference_m

    def _place_m(self, increments: int) -> float:
        return self._origin_m + self._options.position_m(increments)

    def answer(self, command: Command) -> str:
        """Execute a command; return the drive's answer, which is a refusal if the command is not executed."""
        name, number = command.name, command.argument or 0
        if command.argument is None and (found := self._queried(name)) is not None:
            return found
        if number < 0 and name not in _SIGNED:
            return INVALID_PARAMETER
        if name in ("M", "V") and not self.enabled:
            return OVERTEMPERATURE if self.hot else NOT_AVAILABLE  # Assumed.
        speed_unit, rate = self._options.speed_unit_m_s, self._options.acceleration_unit_m_s2 * self.settings["DEC"]
        match name:
            case "EN":
                if self.hot:
                    return OVERTEMPERATURE
                if not self.enabled:
                    # A motor switched on stays where it is.
                    self.enabled, self._at_speed = True, False
                    self.target_m = self._loaded_m = self.position_m
            case "DI":
                self.lose_power()
            case "LA":
                self._loaded_m = self._place_m(number)
            case "M" | "V":
                self._motion, self._at_speed = Motion(self.now_s, *self._motion.at(self.now_s)), name == "V"
                if name == "V":
                    most = self.settings["SP"]
                    self._motion.to_speed(min(max(number, -most), most) * speed_unit, rate)
                else:
                    # Assumed: without a target loaded since, the last one counts, also after motion at a speed.
                    self.target_m = self._loaded_m
                    if self.settings["APL"]:
                        # Assumed: a target beyond the limits is approached as far as they allow.
                        lower, upper = (self._place_m(self.settings[end]) for end in ("GNL", "GPL"))
                        self.target_m = min(max(self.target_m, lower), upper)
                    self._motion.to_position(self.target_m, speed_unit * self.settings["SP"], rate)
            case "HO":
                self._origin_m = self.position_m - self._options.position_m(number)
            case "LL":
                if number == 0:
                    return INVALID_PARAMETER  # Assumed: zero has no sign that picks a limit.
                self.settings["GPL" if number > 0 else "GNL"] = number
            case _ if name in self.settings:
                self.settings[name] = number
            case _:
                return UNKNOWN_COMMAND
        return OK

    def _queried(self, name: str) -> str | None:
        of, (place_m, limited) = self._options, self._pressed()
        match name:
            case "POS" | "TPOS":
                found = round(((place_m if name == "POS" else self.target_m) - self._origin_m) / of.increment_m)
            case "GN":
                found = 0 if limited else round(self._motion.at(self.now_s)[1] / of.speed_unit_m_s)
            case "OST":
                near = abs(place_m - self.target_m) <= of.position_m(self.settings["CORRIDOR"])
                attained = near and not self._at_speed and not self.moving
                found = limited * OperationStatus.CURRENT_LIMITATION | self.hot * OperationStatus.OVERTEMPERATURE
                found |= attained * OperationStatus.POSITION_ATTAINED
            case "CST":
                found = (self.settings["ANSW"] == 2) * Configuration.ACKNOWLEDGES
                found |= self.enabled * Configuration.POWER_STAGE
                found |= self.settings["APL"] * Configuration.POSITION_LIMITS
            case _ if name in _READ_BACK:
                found = self.settings[_READ_BACK[name]]
            case _:
                return "EMULATOR" if name == "VER" else None
        return str(int(found))


@dataclass(frozen=True)
class MotorFault(Fault):
    """A fault of the drive or its line."""

    known: ClassVar[Mapping[str, str]] = {
        "motor-fault": "too hot: without power until the fault is over and the drive is enabled again",
        "garbled-line": "one byte of a line is replaced by another",
    }


class MotorEmulator(DeviceEmulator):
    """Emulated drive with its motor, and the speed of its serial line; its `faults` may be changed at any time.

    Raises UsageError for unknown options or faults.
    """

    def __init__(self, settings: EmulatorSettings) -> None:
        options = read_options(FaulhaberOptions, settings.options, "faulhaber")
        self.drive = Drive(options)
        self.faults = [MotorFault.parse(text) for text in settings.faults]
        self._byte_s = line_time_s(1, options.baud)
        self._rng = settings.rng
        self._seen: Counter[Fault] = Counter()
        self._reader = CommandReader()
        self._now_s = self._in_free_s = self._out_free_s = -math.inf
        self._in: deque[tuple[float, bytes]] = deque()
        self._out: deque[tuple[float, bytes]] = deque()

    @property
    def position_m(self) -> float:
        """Position of the motor in the coordinate of its driver after homing [m]."""
        return self.drive.position_m

    def press_against(self, force_n: Load | None) -> None:
        """Let a force [N], given as function of :attr:`position_m`, act on the motor; None: no force."""
        self.drive.load = force_n

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[Sent]:
        """Process bytes sent by the host from `now_s` on, at the line's rate; return the same as `poll`.

        Time never goes back: a time before the latest counts as the latest.
        """
        assert isinstance(piece, bytes)
        self._in_free_s = max(self._in_free_s, now_s, self._now_s)
        for part in piece.splitlines(keepends=True):
            self._in_free_s += len(part) * self._byte_s
            self._in.append((self._in_free_s, part))
        return self.poll(now_s)

    def poll(self, now_s: float) -> list[Sent]:
        """Advance to `now_s`; return the data sent until then: of each line the first byte, then the rest."""
        now_s = max(now_s, self._now_s)
        while self._in and self._in[0][0] <= now_s:
            at_s, part = self._in.popleft()
            self._go_to(at_s)
            for command in self._reader.feed(part):
                self._send(self.drive.answer(command), at_s + ANSWER_S)
        self._go_to(now_s)
        found: list[Sent] = []
        while self._out and self._out[0][0] <= now_s:
            found.append(self._out.popleft())
        return found

    def next_s(self) -> float:
        """Return the time [s] of the next event: a command received, a line sent, a fault, or a moving motor's tick."""
        faults_s = [fault.start_s for fault in self.faults if fault.start_s > self._now_s]
        queues_s = [queue[0][0] for queue in (self._in, self._out) if queue]
        return min([*queues_s, *faults_s, self._now_s + TICK_S if self.drive.moving else math.inf])

    def _go_to(self, now_s: float) -> None:
        self._now_s = self.drive.now_s = now_s
        hot = any(fault.name == "motor-fault" and fault.active(now_s) for fault in self.faults)
        if hot and not self.drive.hot:
            self.drive.lose_power()
            self._send("f", now_s)
        self.drive.hot = hot

    def _send(self, text: str, at_s: float) -> None:
        line = bytearray(text.encode("ascii") + b"\r\n")
        if fault_concerns(self.faults, "garbled-line", at_s, self._seen):
            # Any other byte than the right one, also a digit for a digit, which no host can notice.
            line[int(self._rng.integers(len(line)))] ^= int(self._rng.integers(1, 256))
        first_s = max(self._out_free_s, at_s) + self._byte_s
        self._out_free_s = first_s + (len(line) - 1) * self._byte_s
        # A host stamps a line at its first byte, and has it at its last.
        self._out += [(first_s, bytes(line[:1])), (self._out_free_s, bytes(line[1:]))]
