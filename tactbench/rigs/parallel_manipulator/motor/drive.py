"""The drive as a model: commands in, answers out, a tick at a time; no bytes and no line.

What the drive does where no public document says so is assumed, and marked so beside the code. Commands that it has and
this model does not (loop gains, programs, inputs) are refused as "Command not available".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from tactbench.rigs.parallel_manipulator.motor.codec import (
    BAUDS,
    INVALID_PARAMETER,
    NOT_AVAILABLE,
    OK,
    OVERTEMPERATURE,
    QUERIES,
    SAVED,
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
from tactbench.rigs.parallel_manipulator.motor.servo import Load, MotorModel, Profile, Servo

_REFUSED = "POR I PP PD SR CI NV NVOFF CAHOSEQ HA HL HN HP SHA SHL SHN GOIX LOADHO"
_NOT_MODELLED = QUERIES.union(_REFUSED.split())
"""Commands of the drive that are refused here, but for the queries that `_query` knows."""


_SETTINGS = {
    "SP": ("speed", LARGEST_SPEED, 0),
    "AC": ("acceleration", LARGEST_ACCELERATION, 1),
    "DEC": ("braking", LARGEST_ACCELERATION, 1),
    "CORRIDOR": ("corridor", 32767, 0),
    "DEV": ("deviation", 32767, 0),
    "LPC": ("peak_current", LARGEST_CURRENT, 0),
    "LCC": ("continuous_current", LARGEST_CURRENT, 0),
    "HOSP": ("homing_speed", LARGEST_SPEED, 0),
    "NODEADR": ("node", 255, 0),
    "ANSW": ("answer_mode", 2, 0),
}
"""Commands that set a number: its field, its largest value, and its least."""
_READ_BACK = {
    "GSP": "SP", "GAC": "AC", "GDEC": "DEC", "GPC": "LPC", "GCC": "LCC", "GCORRIDOR": "CORRIDOR", "GDEV": "DEV",
}  # fmt: skip


class Refused(Exception):  # noqa: N818  (an answer, not a failure of ours)
    """The drive's text for a command that it does not carry out."""


@dataclass
class Settings:
    """What SAVE keeps, in the drive's units."""

    speed: int
    acceleration: int
    braking: int
    positive_limit: int
    negative_limit: int
    limits_on: bool
    peak_current: int
    continuous_current: int
    corridor: int = 20
    """Increments around the target within which it is reached (assumed)."""
    deviation: int = 2000
    """Increments from the reference at which OST says so (assumed)."""
    homing_speed: int = 5
    node: int = 0
    """Sourced: as the drive ships."""
    answer_mode: int = 2
    baud: int = 9600
    """Sourced: as the drive ships."""


class Drive:
    """A drive and its motor.

    Parameters
    ----------
    load
        Force on the motor [N] at a position [m] and a time [s], positive against positive motion; None: none, ever.
    profile, model
        Units of the drive; mechanics of the motor.
    reference_switch_m
        Where GOHOSEQ finds its switch [m]; None: there is none, and GOHOSEQ is refused.
    """

    def __init__(
        self, load: Load | None, profile: FaulhaberOptions, model: MotorModel, reference_switch_m: float | None
    ) -> None:
        self.profile = profile
        self.servo = Servo(model, load)
        self.standing = False
        """Whether further ticks change nothing, to the servo's resolution, before a command."""
        self.hot = False
        """Too hot: without power, and without any until it is switched on again."""
        self._reference_switch_m = reference_switch_m
        # Speeds and limits at power-on are assumed.
        travel = [profile.increments(stop.to("m")) for stop in model.travel]
        self._saved = Settings(
            speed=profile.speed(0.05),
            acceleration=profile.acceleration(1.0),
            braking=profile.acceleration(1.0),
            positive_limit=travel[1],
            negative_limit=travel[0],
            limits_on=False,
            peak_current=profile.current(model.peak_current.to("A")),
            continuous_current=profile.current(model.continuous_current.to("A")),
        )
        self._power_on()

    def _power_on(self) -> None:
        self.settings = replace(self._saved)
        self._enabled = False
        self.origin_m = self.servo.position_m
        """Where the drive counts from, as the servo does [m]."""
        # Positions are lost without power (assumed: incremental).
        self._reference = Profile(self.servo.position_m)
        self._loaded_m: float | None = None
        self._target_m = self.servo.position_m
        self._velocity: int | None = None
        self._homing = False
        self._attained = True
        self._notify_end = False

    def overheat(self) -> None:
        """Take the power off until `hot` is set back and the drive is enabled again."""
        self.hot, self._enabled, self._homing = True, False, False
        self.standing = False

    def tick(self, at_s: float) -> list[str]:
        """Go one tick, to `at_s`; return the notices it causes."""
        profile, settings, reference = self.profile, self.settings, self._reference
        reference_before_m = reference.position_m
        if not self._enabled:
            self.servo.step(at_s, None, 0.0)
            reference.stop_at(self.servo.position_m)
        else:
            speed = settings.speed * profile.speed_unit_m_s
            acceleration = settings.acceleration * profile.acceleration_unit_m_s2
            braking = settings.braking * profile.acceleration_unit_m_s2
            if self._velocity is not None:
                commanded = min(max(self._velocity * profile.speed_unit_m_s, -speed), speed)
                reference.to_speed(self._at_limits(commanded, braking), self.servo.tick_s, acceleration, braking)
            else:
                if self._homing:
                    speed = settings.homing_speed * profile.speed_unit_m_s
                reference.to_position(self._target_m, self.servo.tick_s, speed, acceleration, braking)
            self.servo.step(at_s, reference, self._limit_a())
        notices = self._notify()
        # A load may change with time.
        self.standing = (
            self.servo.load is None
            and not notices
            and not self.servo.limited
            and reference.position_m == reference_before_m
            and reference.speed_m_s == 0.0
            and self.servo.settled(reference)
        )
        return notices

    def _at_limits(self, commanded: float, braking: float) -> float:
        if not self.settings.limits_on:
            return commanded
        lower, upper = self._limits_m()
        end_m = upper if commanded > 0.0 else lower
        room_m = max((end_m - self._reference.position_m) * (1.0 if commanded > 0.0 else -1.0), 0.0)
        largest = Profile.braking_speed(room_m, self.servo.tick_s, braking)
        return min(max(commanded, -largest), largest)

    def _limits_m(self) -> tuple[float, float]:
        settings = self.settings
        return self._place_m(settings.negative_limit), self._place_m(settings.positive_limit)

    def _limit_a(self) -> float:
        return self.settings.peak_current * self.profile.current_unit_a

    def _place_m(self, increments: float) -> float:
        return self.origin_m + self.profile.position_m(increments)

    def _increments(self, position_m: float) -> int:
        return round((position_m - self.origin_m) / self.profile.increment_m)

    def _notify(self) -> list[str]:
        notices = []
        near = abs(self.servo.position_m - self._target_m) <= self.profile.position_m(self.settings.corridor)
        attained = self._velocity is None and self._reference.position_m == self._target_m and near and self._enabled
        if attained and self._homing:
            # The switch defines zero (assumed: GOHOSEQ as its programming by the maker's tools has it).
            self._homing = False
            self.origin_m = self._target_m
        if self._notify_end and attained and not self._attained:
            self._notify_end = False
            notices.append("p")
        # A target once reached stays reached until the next motion (assumed).
        self._attained = self._velocity is None and (self._attained or attained)
        return notices

    def answer(self, command: Command) -> str:
        """Carry a command out; return its answer, empty if it has none.

        Raises
        ------
        Refused
            If the drive does not carry it out; its text is the answer.
        """
        self.standing = False
        name, argument = command.name, command.argument
        query = self._query(name)
        if query is not None:
            if argument is not None:
                raise Refused(INVALID_PARAMETER)
            return query()
        if name in _NOT_MODELLED:
            raise Refused(NOT_AVAILABLE)
        settings = self.settings
        if name in _SETTINGS:
            field, most, least = _SETTINGS[name]
            setattr(settings, field, self._number(argument, most, least=least))
            return OK
        match name:
            case "EN":
                if self.hot:
                    raise Refused(OVERTEMPERATURE)
                if not self._enabled:
                    # A motor switched on stays where it is.
                    self._enabled, self._attained, self._velocity = True, True, None
                    self._target_m = self.servo.position_m
                    self._reference.stop_at(self._target_m)
            case "DI":
                self._enabled = self._homing = False
            case "LA":
                self._loaded_m = self._place_m(self._number(argument, LARGEST_POSITION, signed=True))
            case "LR":
                # Relative to the target before (assumed), so that steps do not add up errors of control.
                steps = self._number(argument, LARGEST_POSITION, signed=True)
                base_m = self._target_m if self._velocity is None else self.servo.position_m
                self._loaded_m = base_m + self.profile.position_m(steps)
            case "M":
                self._move()
            case "V":
                self._need_power()
                self._velocity = self._number(argument, LARGEST_SPEED, signed=True)
                self._attained = self._homing = False
            case "HO":
                commanded = 0 if argument is None else self._number(argument, LARGEST_POSITION, signed=True)
                self.origin_m = self.servo.position_m - self.profile.position_m(commanded)
            case "GOHOSEQ":
                if self._reference_switch_m is None:
                    raise Refused(NOT_AVAILABLE)
                self._need_power()
                self._loaded_m, self._velocity = None, None
                self._homing, self._attained, self._target_m = True, False, self._reference_switch_m
            case "NP":
                self._notify_end = argument is None  # a place to be told of is taken, and never told of
            case "NPOFF":
                self._notify_end = False
            case "LL":
                limit = self._number(argument, LARGEST_POSITION, signed=True)
                if limit > 0:
                    settings.positive_limit = limit
                elif limit < 0:
                    settings.negative_limit = limit
                else:
                    raise Refused(INVALID_PARAMETER)  # Assumed: zero has no sign that picks a limit.
            case "APL":
                settings.limits_on = bool(self._number(argument, 1))
            case "SOR":
                if self._number(argument, 4) != 0:
                    raise Refused(NOT_AVAILABLE)  # Only speeds from RS232 are modelled.
            case "BAUD":
                if argument not in BAUDS:
                    raise Refused(INVALID_PARAMETER)
                settings.baud = argument
                return ""  # The answer at the new rate is in no source.
            case "SAVE" | "EEPSAV":
                self._saved = replace(settings)
                return SAVED
            case "RESET":
                self._power_on()
                return ""  # Assumed.
            case _:
                raise Refused(UNKNOWN_COMMAND)
        return OK

    def _move(self) -> None:
        self._need_power()
        if self._loaded_m is not None:
            lower, upper = self._limits_m()
            # Assumed: a target beyond the limits is approached as far as they allow.
            target_m = min(max(self._loaded_m, lower), upper) if self.settings.limits_on else self._loaded_m
            self._loaded_m, self._target_m = None, target_m
        # Assumed: without a target loaded since, the last one counts, also after motion at a speed.
        self._velocity, self._attained, self._homing = None, False, False

    def _need_power(self) -> None:
        if not self._enabled:
            raise Refused(OVERTEMPERATURE if self.hot else NOT_AVAILABLE)  # Assumed.

    @staticmethod
    def _number(argument: int | None, largest: int, *, signed: bool = False, least: int = 0) -> int:
        if argument is None or not (-largest if signed else least) <= argument <= largest:
            raise Refused(INVALID_PARAMETER)
        return argument

    def _query(self, name: str) -> Callable[[], str] | None:
        settings, profile, servo = self.settings, self.profile, self.servo

        def ost() -> str:
            away = abs(self._reference.position_m - servo.position_m)
            status = OperationStatus(0)
            for on, bit in (
                (self._homing, OperationStatus.HOMING),
                (servo.limited, OperationStatus.CURRENT_LIMITATION),
                (away > profile.position_m(settings.deviation), OperationStatus.DEVIATION_ERROR),
                (self.hot, OperationStatus.OVERTEMPERATURE),
                (self._attained, OperationStatus.POSITION_ATTAINED),
            ):
                status |= bit if on else OperationStatus(0)
            return str(int(status))

        def cst() -> str:
            bits = (
                (settings.answer_mode == 2, Configuration.ACKNOWLEDGES),
                (self._enabled, Configuration.POWER_STAGE),
                (settings.limits_on, Configuration.POSITION_LIMITS),
            )
            return str(sum(int(bit) for on, bit in bits if on))

        found: dict[str, Callable[[], str]] = {
            "POS": lambda: str(self._increments(servo.position_m)),
            "TPOS": lambda: str(self._increments(self._target_m)),
            "GV": lambda: str(self._velocity or 0),
            "GN": lambda: str(round(servo.speed_m_s / profile.speed_unit_m_s)),
            # Without sign (assumed).
            "GRC": lambda: str(round(abs(servo.current_a) / profile.current_unit_a)),
            "GCL": lambda: str(round(self._limit_a() / profile.current_unit_a)),
            "TEM": lambda: "25",
            "VER": lambda: "EMULATOR",
            "GTYP": lambda: "linear motor, Faulhaber ASCII",
            "GSER": lambda: "0",
            "OST": ost,
            "CST": cst,
            "GST": lambda: f"{int(self._velocity is None)}00{int(self._enabled)}{int(self._attained)}00",
            "GFS": lambda: f"{int(self.hot)}{int(servo.limited)}00",
            "GPL": lambda: str(settings.positive_limit),
            "GNL": lambda: str(settings.negative_limit),
        }
        if name in _READ_BACK:
            return lambda: str(getattr(settings, _SETTINGS[_READ_BACK[name]][0]))
        return found.get(name)
