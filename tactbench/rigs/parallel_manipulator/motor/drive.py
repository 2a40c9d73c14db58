"""The drive and its motor as a model: commands in, answers out, a tick at a time; no bytes and no line.

What the drive does where no public document says so is assumed, and marked so beside the code. The commands are those
that a driver sends. Quasi-static (assumed): the motor follows the reference with a first-order lag, as far as the load
permits at the current limit. Mass, friction and heat are left out; without power it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

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
"""Force on the motor [N], positive against positive motion, at a position [m]; it does not fall with position."""
REST_M, REST_M_S = 1e-9, 1e-8
"""A thousandth of an increment of 1 um, and ten times the resolution of the speed."""

_LARGEST = {
    "SP": LARGEST_SPEED, "AC": LARGEST_ACCELERATION, "DEC": LARGEST_ACCELERATION, "CORRIDOR": 32767,
    "LPC": LARGEST_CURRENT, "LCC": LARGEST_CURRENT, "HOSP": LARGEST_SPEED, "APL": 1, "ANSW": 2, "SOR": 0,
}  # fmt: skip
"""Commands that set a number, and its largest value."""
_READ_BACK = {"GSP": "SP", "GAC": "AC", "GDEC": "DEC", "GPC": "LPC", "GCC": "LCC", "GCORRIDOR": "CORRIDOR"}
_ABOUT = {"VER": "EMULATOR", "GTYP": "linear motor, Faulhaber ASCII", "GSER": "0"}


@dataclass(frozen=True)
class MotorModel:
    """The mechanics of the emulated motor (all assumed: of the order of small tubular linear motors)."""

    force_constant_n_a: float = 6.5
    peak_current_a: float = 1.6
    """LPC at power-on."""
    continuous_current_a: float = 1.0
    """LCC at power-on; read back, and otherwise without effect."""
    stops_m: tuple[float, float] = (-10e-3, 10e-3)
    """Mechanical end stops, from the place at power-on."""
    lag_s: float = 5e-3
    """Time constant of the closed position loop."""
    tick_s: float = 1e-3
    """Coarser than a real drive's, for speed; without a load the lag is exact for every tick."""
    answer_s: float = 1e-3
    """From the end of a command to the start of its answer."""


class Refused(Exception):  # noqa: N818  (an answer, not a failure of ours)
    """The drive's text for a command that it does not carry out."""


class Profile:
    """The reference: a trapezoid of speed, recomputed every tick, that ends on its target."""

    def __init__(self, position_m: float) -> None:
        self.position_m = position_m
        self.speed_m_s = 0.0

    def to_position(self, target_m: float, tick_s: float, speed: float, acceleration: float, braking: float) -> None:
        """Go one tick towards a target [m]; speed [m/s], acceleration and braking [m/s^2], all positive."""
        slow = braking * tick_s * (1 + 1e-9)
        if self.position_m == target_m and abs(self.speed_m_s) <= slow:
            self.speed_m_s = 0.0
            return
        away = target_m - self.position_m
        commanded = math.copysign(min(speed, self._braking_speed(away, tick_s, braking)), away)
        self.to_speed(commanded, tick_s, acceleration, braking)
        # The last tick ends within rounding of its target.
        if abs(target_m - self.position_m) < 1e-12 and abs(self.speed_m_s) <= slow:
            self.position_m = target_m

    def to_speed(self, commanded: float, tick_s: float, acceleration: float, braking: float) -> None:
        """Go one tick towards a speed [m/s]; backwards goes through rest."""
        now = self.speed_m_s
        if now * commanded < 0.0:
            commanded = 0.0
        largest = (acceleration if abs(commanded) > abs(now) else braking) * tick_s
        self.speed_m_s = now + min(max(commanded - now, -largest), largest)
        self.position_m += self.speed_m_s * tick_s

    @staticmethod
    def _braking_speed(away_m: float, tick_s: float, braking: float) -> float:
        """Return the speed of the next tick from which whole ticks of braking end on the target, `away_m` from here.

        n ticks of speed v, v - a h, ..., v - (n - 1) a h cover h (n v - a h n (n - 1) / 2), n the least number of ticks
        that reaches (derived).
        """
        step = braking * tick_s
        n = max(1, math.ceil(math.sqrt(0.25 + 2.0 * abs(away_m) / (step * tick_s)) - 0.5))
        return abs(away_m) / (n * tick_s) + step * (n - 1) / 2.0


class Drive:
    """A drive and its motor.

    Parameters
    ----------
    load
        Force on the motor; None: none, ever.
    profile, model
        Units of the drive; mechanics of the motor.
    reference_switch_m
        Where GOHOSEQ finds its switch [m]; None: there is none, and GOHOSEQ is refused.

    Attributes
    ----------
    settings
        Numbers by the command that sets them; LL has two, GPL and GNL.
    position_m, speed_m_s, current_a
        Of the motor.
    stops
        Mechanical ends [m].
    standing
        Whether further ticks change nothing, to the motor's resolution, before a command.
    hot
        Too hot: without power, and without any until it is switched on again.
    """

    def __init__(
        self, load: Load | None, profile: FaulhaberOptions, model: MotorModel, reference_switch_m: float | None
    ) -> None:
        self.profile, self.model, self.load, self.stops = profile, model, load, model.stops_m
        self.position_m = self.speed_m_s = self.current_a = 0.0
        self.standing = self.hot = self._limited = False
        self._reference_switch_m = reference_switch_m
        self._kept = math.exp(-model.tick_s / model.lag_s)
        self._power_on()

    def _power_on(self) -> None:
        """Begin with settings that are assumed, and without a place (assumed: incremental)."""
        profile, model = self.profile, self.model
        self.settings = {
            "SP": profile.speed(0.05), "AC": profile.acceleration(1.0), "DEC": profile.acceleration(1.0),
            "LPC": profile.current(model.peak_current_a), "LCC": profile.current(model.continuous_current_a),
            "GNL": profile.increments(model.stops_m[0]), "GPL": profile.increments(model.stops_m[1]),
            "CORRIDOR": 20, "HOSP": 5, "APL": 0, "ANSW": 2,
        }  # fmt: skip
        self._origin_m = self._target_m = self.position_m
        self._reference = Profile(self.position_m)
        self._loaded_m: float | None = None
        self._velocity: int | None = None
        self._enabled = self._homing = False
        self._attained = True

    def overheat(self) -> None:
        """Take the power off until `hot` is set back and the drive is enabled again."""
        self.hot, self._enabled, self._homing, self.standing = True, False, False, False

    def tick(self) -> None:
        """Go one tick."""
        profile, settings, reference = self.profile, self.settings, self._reference
        before_m = reference.position_m
        if self._enabled:
            rates = [profile.acceleration_unit_m_s2 * settings[name] for name in ("AC", "DEC")]
            speed = profile.speed_unit_m_s * settings["HOSP" if self._homing else "SP"]
            if self._velocity is None:
                reference.to_position(self._target_m, self.model.tick_s, speed, *rates)
            else:
                commanded = min(max(self._velocity * profile.speed_unit_m_s, -speed), speed)
                reference.to_speed(commanded, self.model.tick_s, *rates)
            self._follow(reference.position_m)
        else:
            self._reference = reference = Profile(self.position_m)
            self.speed_m_s, self.current_a, self._limited = 0.0, 0.0, False
        near = abs(self.position_m - self._target_m) <= profile.position_m(settings["CORRIDOR"])
        attained = self._enabled and self._velocity is None and reference.position_m == self._target_m and near
        if attained and self._homing:
            # The switch defines zero (assumed: GOHOSEQ as its programming by the maker's tools has it).
            self._homing, self._origin_m = False, self._target_m
        # A target once reached stays reached until the next motion (assumed).
        self._attained = self._velocity is None and (self._attained or attained)
        self.standing = (
            self.load is None
            and not self._limited
            and reference.position_m == before_m
            and reference.speed_m_s == 0.0
            and abs(self.position_m - before_m) <= REST_M
            and abs(self.speed_m_s) <= REST_M_S
        )

    def _follow(self, reference_m: float) -> None:
        """Let the motor go one tick towards the reference."""
        low, high = self.stops
        wish = reference_m + self._kept * (self.position_m - reference_m)
        moved = min(max(wish, low), high)
        self._limited = moved != wish
        force_n = self._force_n(moved)
        most_n = self.model.force_constant_n_a * self.settings["LPC"] * self.profile.current_unit_a
        if abs(force_n) > most_n:
            self._limited = True
            # Where the load is as large as the limit: further out for a load against positive motion.
            between_m = (low, moved) if force_n > 0 else (moved, high)
            moved = self._balance(math.copysign(most_n, force_n), between_m)
        if self._limited:
            force_n = math.copysign(most_n, reference_m - moved)
        self.speed_m_s = (moved - self.position_m) / self.model.tick_s
        self.position_m, self.current_a = moved, force_n / self.model.force_constant_n_a

    def _force_n(self, position_m: float) -> float:
        return 0.0 if self.load is None else self.load(position_m)

    def _balance(self, force_n: float, between_m: tuple[float, float]) -> float:
        """Return the place between two at which the load is a force."""
        low, high = between_m
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._force_n(middle) < force_n else (low, middle)
        return 0.5 * (low + high)

    def _place_m(self, increments: int) -> float:
        return self._origin_m + self.profile.position_m(increments)

    def _increments(self, position_m: float) -> int:
        return round((position_m - self._origin_m) / self.profile.increment_m)

    def answer(self, command: Command) -> str:
        """Carry a command out; return its answer, empty if it has none.

        Raises
        ------
        Refused
            If the drive does not carry it out; its text is the answer.
        """
        self.standing = False
        name, argument = command.name, command.argument
        if argument is None and (found := self._queried(name)) is not None:
            return found
        if name in _LARGEST:
            self.settings[name] = self._number(argument, _LARGEST[name], least=0)
            return OK
        match name:
            case "EN":
                if self.hot:
                    raise Refused(OVERTEMPERATURE)
                if not self._enabled:
                    # A motor switched on stays where it is.
                    self._enabled, self._attained, self._velocity = True, True, None
                    self._target_m = self.position_m
            case "DI":
                self._enabled = self._homing = False
            case "LA":
                self._loaded_m = self._place_m(self._number(argument, LARGEST_POSITION))
            case "M":
                self._move()
            case "V":
                self._need_power()
                self._velocity = self._number(argument, LARGEST_SPEED)
                self._attained = self._homing = False
            case "HO":
                called = 0 if argument is None else self._number(argument, LARGEST_POSITION)
                self._origin_m = self.position_m - self.profile.position_m(called)
            case "GOHOSEQ":
                if self._reference_switch_m is None:
                    raise Refused(NOT_AVAILABLE)
                self._need_power()
                self._loaded_m, self._velocity = None, None
                self._homing, self._attained, self._target_m = True, False, self._reference_switch_m
            case "LL":
                limit = self._number(argument, LARGEST_POSITION)
                if limit == 0:
                    raise Refused(INVALID_PARAMETER)  # Assumed: zero has no sign that picks a limit.
                self.settings["GPL" if limit > 0 else "GNL"] = limit
            case "RESET":
                self._power_on()
                return ""  # Assumed.
            case _:
                raise Refused(UNKNOWN_COMMAND)
        return OK

    def _move(self) -> None:
        self._need_power()
        if self._loaded_m is not None:
            self._target_m, self._loaded_m = self._loaded_m, None
            if self.settings["APL"]:
                # Assumed: a target beyond the limits is approached as far as they allow.
                lower, upper = (self._place_m(self.settings[end]) for end in ("GNL", "GPL"))
                self._target_m = min(max(self._target_m, lower), upper)
        # Assumed: without a target loaded since, the last one counts, also after motion at a speed.
        self._velocity, self._attained, self._homing = None, False, False

    def _need_power(self) -> None:
        if not self._enabled:
            raise Refused(OVERTEMPERATURE if self.hot else NOT_AVAILABLE)  # Assumed.

    @staticmethod
    def _number(argument: int | None, largest: int, *, least: int | None = None) -> int:
        if argument is None or not (-largest if least is None else least) <= argument <= largest:
            raise Refused(INVALID_PARAMETER)
        return argument

    def _queried(self, name: str) -> str | None:
        """Return the answer to a query; None: it is none."""
        if name in _ABOUT:
            return _ABOUT[name]
        match name:
            case "POS":
                found = self._increments(self.position_m)
            case "TPOS":
                found = self._increments(self._target_m)
            case "GN":
                found = round(self.speed_m_s / self.profile.speed_unit_m_s)
            case "GRC":
                found = round(abs(self.current_a) / self.profile.current_unit_a)  # Without sign (assumed).
            case "OST":
                found = self._bits(
                    (self._homing, OperationStatus.HOMING),
                    (self._limited, OperationStatus.CURRENT_LIMITATION),
                    (self.hot, OperationStatus.OVERTEMPERATURE),
                    (self._attained, OperationStatus.POSITION_ATTAINED),
                )
            case "CST":
                found = self._bits(
                    (self.settings["ANSW"] == 2, Configuration.ACKNOWLEDGES),
                    (self._enabled, Configuration.POWER_STAGE),
                    (self.settings["APL"] == 1, Configuration.POSITION_LIMITS),
                )
            case "GPL" | "GNL":
                found = self.settings[name]
            case _ if name in _READ_BACK:
                found = self.settings[_READ_BACK[name]]
            case _:
                return None
        return str(found)

    @staticmethod
    def _bits(*bits: tuple[bool, int]) -> int:
        return sum(int(bit) for on, bit in bits if on)
