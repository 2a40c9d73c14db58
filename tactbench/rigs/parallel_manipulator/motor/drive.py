"""Model of the drive and its motor: it answers commands at any time, without encoding or a serial line.

Behaviour without a public source is assumed, as marked in the code. Only the commands sent by the driver are modelled.
Quasi-static (assumed): the motor is where the reference is, as far as the load permits at the current limit, and
accelerates as it brakes, by DEC. Lag, mass, friction and heat are left out; without power it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from tactbench.rigs.parallel_manipulator.motor.codec import (
    INVALID_PARAMETER,
    NOT_AVAILABLE,
    OK,
    OVERTEMPERATURE,
    UNKNOWN_COMMAND,
    Command,
    Configuration,
    OperationStatus,
)
from tactbench.rigs.parallel_manipulator.motor.profile import (
    LARGEST_ACCELERATION,
    LARGEST_CURRENT,
    LARGEST_POSITION,
    LARGEST_SPEED,
    FaulhaberOptions,
)

Load = Callable[[float], float]
"""Function from the position [m] to the force on the motor [N], positive against positive motion, and not falling."""

FORCE_CONSTANT_N_A = 6.5
"""Force constant of an emulated motor [N/A]; it, the currents at power-on and the stops have the size of those of small
tubular linear motors (assumed)."""
PEAK_CURRENT_A, CONTINUOUS_CURRENT_A = 1.6, 1.0
STOPS_M = (-10e-3, 10e-3)
"""Mechanical end stops [m], relative to the place at power-on."""

_LARGEST = {
    "SP": LARGEST_SPEED, "AC": LARGEST_ACCELERATION, "DEC": LARGEST_ACCELERATION, "CORRIDOR": 32767,
    "LPC": LARGEST_CURRENT, "LCC": LARGEST_CURRENT, "APL": 1, "ANSW": 2, "SOR": 0,
}  # fmt: skip
"""Commands that set a number, and the largest value of each number."""
_READ_BACK = {"GSP": "SP", "GAC": "AC", "GDEC": "DEC", "GPC": "LPC", "GCC": "LCC", "GCORRIDOR": "CORRIDOR"}
_ABOUT = {"VER": "EMULATOR", "GTYP": "linear motor, Faulhaber ASCII", "GSER": "0"}


class Refused(Exception):  # noqa: N818  (an answer, not a failure of ours)
    """The drive does not execute a command; the message is its answer."""


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
        """Append a move that ends at rest on a target [m]; speed and acceleration are positive."""
        _, place, now, _ = self._pieces[-1]
        if now * (target_m - place) <= 0.0 or now**2 > 2 * rate * abs(target_m - place):
            self.to_speed(0.0, rate)  # away from it, or past it
        elif abs(now) > speed:
            self.to_speed(math.copysign(speed, now), rate)
        _, place, now, _ = self._pieces[-1]
        # The speed at which acceleration over the first part of the way meets braking over the rest (derived).
        peak = math.sqrt(rate * abs(target_m - place) + 0.5 * now**2)
        peak = max(min(peak, speed), abs(now))
        self.to_speed(math.copysign(peak, target_m - place), rate)
        left = abs(target_m - self._pieces[-1][1]) - peak**2 / (2 * rate)
        if peak > 0.0:
            self._extend(max(0.0, left / peak), 0.0)
        self.to_speed(0.0, rate)
        self._pieces[-1] = (self.end_s, target_m, 0.0, 0.0)


class Drive:
    """Model of a drive with its motor.

    Parameters
    ----------
    load
        Function of the force on the motor; None: no force at any time.
    options
        Options with the units of the drive.
    stops_m
        Mechanical ends of travel [m].

    Attributes
    ----------
    settings
        Numbers by the command that sets them; those of LL are named GPL and GNL.
    now_s
        Present time [s]; set before each call.
    hot
        True if the drive is too hot: it has no power until it has cooled and is enabled again.
    """

    def __init__(self, load: Load | None, options: FaulhaberOptions, stops_m: tuple[float, float]) -> None:
        self.load, self.stops, self.now_s = load, stops_m, 0.0
        self._options = options
        self.settings = {  # assumed
            "SP": options.speed(0.05), "AC": options.acceleration(1.0), "DEC": options.acceleration(1.0),
            "LPC": options.current(PEAK_CURRENT_A), "LCC": options.current(CONTINUOUS_CURRENT_A),
            "GNL": options.increments(stops_m[0]), "GPL": options.increments(stops_m[1]),
            "CORRIDOR": 20, "APL": 0, "ANSW": 2,
        }  # fmt: skip
        self.hot = self.enabled = self._at_speed = False
        self._motion = Motion(0.0, 0.0)
        self._origin_m = self.target_m = 0.0  # assumed: the encoder is incremental
        self._loaded_m: float | None = None

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

    def _pressed(self) -> tuple[float, float, bool]:
        """Return the motor's place [m], its force [N], and True if the force is at the current limit."""
        reference_m = self._motion.at(self.now_s)[0]
        if not self.enabled:
            return reference_m, 0.0, False
        low, high = self.stops
        most_n = FORCE_CONSTANT_N_A * self.settings["LPC"] * self._options.current_unit_a
        place_m = min(max(reference_m, low), high)
        force_n = 0.0 if self.load is None else self.load(place_m)
        if self.load is not None and abs(force_n) > most_n:
            # The place at which load and limit are equal: further out for a load against positive motion.
            low, high = (low, place_m) if force_n > 0 else (place_m, high)
            for _ in range(50):
                place_m = 0.5 * (low + high)
                low, high = (place_m, high) if self.load(place_m) < math.copysign(most_n, force_n) else (low, place_m)
        if place_m != reference_m:
            return place_m, math.copysign(most_n, reference_m - place_m), True
        return place_m, force_n, False

    def _place_m(self, increments: int) -> float:
        return self._origin_m + self._options.position_m(increments)

    def answer(self, command: Command) -> str:
        """Execute a command; return the drive's answer.

        Raises
        ------
        Refused
            If the drive does not execute the command; the message is the drive's answer.
        """
        name, argument = command
        if argument is None and (found := self._queried(name)) is not None:
            return found
        if name in _LARGEST:
            self.settings[name] = self._number(argument, _LARGEST[name], least=0)
            return OK
        match name:
            case "EN":
                if self.hot:
                    raise Refused(OVERTEMPERATURE)
                if not self.enabled:
                    # A motor switched on stays where it is.
                    self.enabled, self._at_speed, self.target_m = True, False, self.position_m
            case "DI":
                self.lose_power()
            case "LA":
                self._loaded_m = self._place_m(self._number(argument, LARGEST_POSITION))
            case "M":
                self._move()
            case "V":
                self._need_power()
                units, most = self._number(argument, LARGEST_SPEED), self.settings["SP"]
                self._at_speed = True
                self._begin().to_speed(min(max(units, -most), most) * self._options.speed_unit_m_s, self._rate)
            case "HO":
                here = 0 if argument is None else self._number(argument, LARGEST_POSITION)
                self._origin_m = self.position_m - self._options.position_m(here)
            case "LL":
                limit = self._number(argument, LARGEST_POSITION)
                if limit == 0:
                    raise Refused(INVALID_PARAMETER)  # Assumed: zero has no sign that picks a limit.
                self.settings["GPL" if limit > 0 else "GNL"] = limit
            case _:
                raise Refused(UNKNOWN_COMMAND)
        return OK

    @property
    def _rate(self) -> float:
        return self._options.acceleration_unit_m_s2 * self.settings["DEC"]

    def _begin(self) -> Motion:
        """Return a new motion that starts from the reference's present place and speed."""
        self._motion = Motion(self.now_s, *self._motion.at(self.now_s))
        return self._motion

    def _move(self) -> None:
        self._need_power()
        if self._loaded_m is not None:
            self.target_m, self._loaded_m = self._loaded_m, None
            if self.settings["APL"]:
                # Assumed: a target beyond the limits is approached as far as they allow.
                lower, upper = (self._place_m(self.settings[end]) for end in ("GNL", "GPL"))
                self.target_m = min(max(self.target_m, lower), upper)
        # Assumed: without a target loaded since, the last one counts, also after motion at a speed.
        self._at_speed = False
        self._begin().to_position(self.target_m, self._options.speed_unit_m_s * self.settings["SP"], self._rate)

    def _need_power(self) -> None:
        if not self.enabled:
            raise Refused(OVERTEMPERATURE if self.hot else NOT_AVAILABLE)  # Assumed.

    @staticmethod
    def _number(argument: int | None, largest: int, *, least: int | None = None) -> int:
        if argument is None or not (-largest if least is None else least) <= argument <= largest:
            raise Refused(INVALID_PARAMETER)
        return argument

    def _queried(self, name: str) -> str | None:
        if name in _ABOUT:
            return _ABOUT[name]
        of, (place_m, force_n, limited) = self._options, self._pressed()
        match name:
            case "POS" | "TPOS":
                found = round(((place_m if name == "POS" else self.target_m) - self._origin_m) / of.increment_m)
            case "GN":
                found = 0 if limited else round(self._motion.at(self.now_s)[1] / of.speed_unit_m_s)
            case "GRC":
                found = round(abs(force_n) / FORCE_CONSTANT_N_A / of.current_unit_a)  # Without sign (assumed).
            case "OST":
                near = abs(place_m - self.target_m) <= of.position_m(self.settings["CORRIDOR"])
                attained = near and not self._at_speed and not self.moving
                found = limited * OperationStatus.CURRENT_LIMITATION | self.hot * OperationStatus.OVERTEMPERATURE
                found |= attained * OperationStatus.POSITION_ATTAINED
            case "CST":
                found = (self.settings["ANSW"] == 2) * Configuration.ACKNOWLEDGES
                found |= self.enabled * Configuration.POWER_STAGE
                found |= self.settings["APL"] * Configuration.POSITION_LIMITS
            case "GPL" | "GNL":
                found = self.settings[name]
            case _ if name in _READ_BACK:
                found = self.settings[_READ_BACK[name]]
            case _:
                return None
        return str(int(found))
