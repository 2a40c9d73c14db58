"""The linear motor's drive as a model without input or output: bytes in, bytes out, on a clock that is passed in.

What the drive answers where no public document says so is assumed, and marked so beside the code. Commands that the drive
has and this model does not (loop gains, programs, inputs) are answered "Command not available".
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tactbench.plugin import UsageError
from tactbench.rigs.parallel_manipulator.motor.codec import (
    BAUDS,
    FLASH_DEFECT,
    INVALID_PARAMETER,
    NOT_AVAILABLE,
    OK,
    OVERTEMPERATURE,
    QUERIES,
    SAVED,
    UNKNOWN_COMMAND,
    Command,
    CommandReader,
    Configuration,
    MotorProfile,
    OperationStatus,
    line_time_s,
)
from tactbench.rigs.parallel_manipulator.motor.servo import Load, MotorModel, Profile, Servo

FAULTS = ("motor fault", "late answers", "garbled line", "flash defect")
"""`motor fault`: too hot, the power stage is off and stays off; `late answers`: by `late_s`; `garbled line`: one byte of
every line is another one; `flash defect`: SAVE fails."""

_NOT_MODELLED = QUERIES | frozenset("POR I PP PD SR CI CAHOSEQ HA HL HN HP SHA SHL SHN GOIX LOADHO".split())
"""Commands of the drive that are refused here, but for the queries that `_query` knows."""


class _Refused(Exception):  # noqa: N818  (an answer, not a failure of ours)
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


class MotorEmulator:
    """A drive and its motor.

    Parameters
    ----------
    load
        Force on the motor [N] at a position [m] and a time [s], positive against positive motion.
    rng
        Draws the bytes of garbled lines.
    profile, model
        Units of the drive; mechanics of the motor.
    reference_switch_m
        Where GOHOSEQ finds its switch; None: there is none, and GOHOSEQ is answered "Command not available".
    late_s
        How much later than usual answers come while `late answers` is on.
    start_s
        Time of power-on.
    """

    def __init__(
        self,
        load: Load,
        rng: np.random.Generator,
        *,
        profile: MotorProfile | None = None,
        model: MotorModel | None = None,
        reference_switch_m: float | None = None,
        late_s: float = 0.25,
        start_s: float = 0.0,
    ) -> None:
        self.profile = profile or MotorProfile()
        self.model = model or MotorModel()
        self.reference_switch_m = reference_switch_m
        self.late_s = late_s
        self.temperature_c = 25.0
        self.servo = Servo(self.model, load)
        self._rng = rng
        self._faults: set[str] = set()
        self._answer_time_s = self.model.answer_time.to("s")
        # Speeds and limits at power-on are assumed.
        travel = [self.profile.increments(stop.to("m")) for stop in self.model.travel]
        self._saved = Settings(
            speed=self.profile.speed(0.05),
            acceleration=self.profile.acceleration(1.0),
            braking=self.profile.acceleration(1.0),
            positive_limit=travel[1],
            negative_limit=travel[0],
            limits_on=False,
            peak_current=self.profile.current(self.model.peak_current.to("A")),
            continuous_current=self.profile.current(self.model.continuous_current.to("A")),
        )
        self._start_s = self._now_s = self._in_free_s = self._out_free_s = start_s
        self._ticks = 0
        self._in: deque[tuple[float, int]] = deque()
        self._out: deque[tuple[float, int]] = deque()
        self._answers: deque[tuple[float, str]] = deque()
        self._power_on()

    def _power_on(self) -> None:
        self.settings = replace(self._saved)
        self._reader = CommandReader()
        self._enabled = False
        self._origin_m = self.servo.position_m  # Positions are lost without power (assumed: incremental).
        self._reference = Profile(self.servo.position_m)
        self._loaded_m: float | None = None
        self._target_m = self.servo.position_m
        self._velocity: int | None = None
        self._homing = False
        self._attained = True
        self._notify_end = False
        self._notify_at_m: float | None = None
        self._notify_speed_m_s: float | None = None

    # What the world sees ------------------------------------------------------------------------------------------

    def set_fault(self, name: str, on: bool = True) -> None:
        """Switch a fault of `FAULTS` on or off; raises UsageError for another name."""
        if name not in FAULTS:
            raise UsageError(f"The motor has no fault {name!r}.", hint=f"Known: {', '.join(FAULTS)}.")
        (self._faults.add if on else self._faults.discard)(name)
        if on and name == "motor fault":
            self._enabled = self._homing = False
            self._notice("f", self._now_s)

    def feed(self, data: bytes, now_s: float) -> bytes:
        """Take bytes that the host sends from `now_s` on, at the line's rate; return what `poll` returns.

        Times do not go back: an earlier one counts as the latest seen.
        """
        now_s = max(now_s, self._now_s)
        byte_s = line_time_s(1, self.settings.baud)
        self._in_free_s = max(self._in_free_s, now_s)
        for byte in data:
            self._in_free_s += byte_s
            self._in.append((self._in_free_s, byte))
        return self.poll(now_s)

    def poll(self, now_s: float) -> bytes:
        """Go on to `now_s`; return the bytes whose last bit has left the drive by then."""
        now_s = max(now_s, self._now_s)
        while self._in and self._in[0][0] <= now_s:
            at_s, byte = self._in.popleft()
            self._go_to(at_s)
            for command in self._reader.feed(bytes([byte])):
                self._carry_out(command, at_s)
        self._go_to(now_s)
        found = bytearray()
        while self._out and self._out[0][0] <= now_s:
            found.append(self._out.popleft()[1])
        return bytes(found)

    def next_event_s(self) -> float:
        """Return when something may happen next: a byte in, an answer, a byte out, or a tick of the drive."""
        queued = [due[0] for queue in (self._in, self._answers, self._out) for due in list(queue)[:1]]
        return min([self._tick_s(self._ticks + 1), *queued])

    # Motion -------------------------------------------------------------------------------------------------------

    def _tick_s(self, tick: int) -> float:
        return self._start_s + tick * self.servo.tick_s

    def _go_to(self, now_s: float) -> None:
        # Ticks stand on a grid of their own, and answers have their times: when it is asked for changes nothing.
        while True:
            tick_s = self._tick_s(self._ticks + 1)
            if self._answers and self._answers[0][0] <= min(tick_s, now_s):
                due_s, text = self._answers.popleft()
                self._send(text, due_s)
            elif tick_s <= now_s:
                self._ticks += 1
                self._tick(tick_s)
            else:
                break
        self._now_s = now_s

    def _tick(self, at_s: float) -> None:
        profile, settings, reference = self.profile, self.settings, self._reference
        before = self.servo.position_m, self.servo.speed_m_s
        if not self._enabled:
            self.servo.step(at_s, None, 0.0)
            reference.stop_at(self.servo.position_m)
        else:
            speed = profile.speed_m_s(settings.speed)
            acceleration = profile.acceleration_m_s2(settings.acceleration)
            braking = profile.acceleration_m_s2(settings.braking)
            if self._velocity is not None:
                wanted = min(max(profile.speed_m_s(self._velocity), -speed), speed)
                reference.to_speed(self._at_limits(wanted, braking), self.servo.tick_s, acceleration, braking)
            else:
                if self._homing:
                    speed = profile.speed_m_s(settings.homing_speed)
                reference.to_position(self._target_m, self.servo.tick_s, speed, acceleration, braking)
            self.servo.step(at_s, reference, self._limit_a())
        self._notify(*before, at_s)

    def _at_limits(self, wanted: float, braking: float) -> float:
        if not self.settings.limits_on:
            return wanted
        lower, upper = self._limits_m()
        end_m = upper if wanted > 0.0 else lower
        room_m = max((end_m - self._reference.position_m) * (1.0 if wanted > 0.0 else -1.0), 0.0)
        largest = Profile.braking_speed(room_m, self.servo.tick_s, braking)
        return min(max(wanted, -largest), largest)

    def _limits_m(self) -> tuple[float, float]:
        settings = self.settings
        return self._place_m(settings.negative_limit), self._place_m(settings.positive_limit)

    def _limit_a(self) -> float:
        peak = self.profile.current_a(self.settings.peak_current)
        return self.servo.limit_a(peak, self.profile.current_a(self.settings.continuous_current))

    def _place_m(self, increments: float) -> float:
        return self._origin_m + self.profile.position_m(increments)

    def _increments(self, position_m: float) -> int:
        return round((position_m - self._origin_m) / self.profile.position_m(1.0))

    def _notify(self, before_m: float, before_m_s: float, at_s: float) -> None:
        position_m, speed_m_s = self.servo.position_m, self.servo.speed_m_s
        near = abs(position_m - self._target_m) <= self.profile.position_m(self.settings.corridor)
        attained = self._velocity is None and self._reference.position_m == self._target_m and near and self._enabled
        if attained and self._homing:
            # The switch defines zero (assumed: GOHOSEQ as its programming by the maker's tools has it).
            self._homing = False
            self._origin_m = position_m
            self._target_m = position_m
            self._reference.stop_at(position_m)
        # A target once reached stays reached until the next motion (assumed).
        self._attained = self._velocity is None and (self._attained or attained)
        if self._notify_end and attained:
            self._notify_end = False
            self._notice("p", at_s)
        at_m = self._notify_at_m
        if at_m is not None and (before_m - at_m) * (position_m - at_m) <= 0.0:
            self._notify_at_m = None
            self._notice("p", at_s)
        wanted = self._notify_speed_m_s
        # Passed, or within half of the drive's unit.
        if wanted is not None and (
            (before_m_s - wanted) * (speed_m_s - wanted) <= 0.0
            or abs(speed_m_s - wanted) <= 0.5 * self.profile.speed_m_s(1.0)
        ):
            self._notify_speed_m_s = None
            self._notice("v", at_s)

    # The line -----------------------------------------------------------------------------------------------------

    def _notice(self, letter: str, at_s: float) -> None:
        if self.settings.answer_mode:
            self._send(letter, at_s)

    def _send(self, text: str, at_s: float) -> None:
        line = bytearray(text.encode("ascii") + b"\r\n")
        if "garbled line" in self._faults:
            # Any other byte than the right one: also a digit for a digit, which no host can notice.
            line[int(self._rng.integers(len(line)))] ^= int(self._rng.integers(1, 256))
        byte_s = line_time_s(1, self.settings.baud)
        self._out_free_s = max(self._out_free_s, at_s)
        for byte in line:
            self._out_free_s += byte_s
            self._out.append((self._out_free_s, byte))

    def _carry_out(self, command: Command, at_s: float) -> None:
        if command.node is not None and command.node != self.settings.node:
            return
        mode = self.settings.answer_mode
        try:
            answer = self._answer(command)
            # Only queries and SAVE answer without ANSW2 (assumed for ANSW1).
            silent = answer == OK and self.settings.answer_mode < 2
        except _Refused as refusal:
            answer, silent = str(refusal), mode < 2
        if answer and not silent:
            late_s = self.late_s if "late answers" in self._faults else 0.0
            # Answers keep the order of their commands, also when the fault ends between two of them.
            due_s = at_s + self._answer_time_s + late_s
            self._answers.append((max(due_s, self._answers[-1][0]) if self._answers else due_s, answer))

    # Commands -----------------------------------------------------------------------------------------------------

    def _answer(self, command: Command) -> str:
        name, argument = command.name, command.argument
        query = self._query(name)
        if query is not None:
            if argument is not None:
                raise _Refused(INVALID_PARAMETER)
            return query()
        if name in _NOT_MODELLED:
            raise _Refused(NOT_AVAILABLE)
        settings = self.settings
        match name:
            case "EN":
                if "motor fault" in self._faults:
                    raise _Refused(OVERTEMPERATURE)
                if not self._enabled:
                    # A motor switched on stays where it is.
                    self._enabled, self._attained, self._velocity = True, True, None
                    self._target_m = self.servo.position_m
                    self._reference.stop_at(self._target_m)
            case "DI":
                self._enabled = self._homing = False
            case "LA":
                self._loaded_m = self._place_m(self._number(argument, self.profile.largest_position, signed=True))
            case "LR":
                # Relative to the target before (assumed), so that steps do not add up errors of control.
                steps = self._number(argument, self.profile.largest_position, signed=True)
                base_m = self._target_m if self._velocity is None else self.servo.position_m
                self._loaded_m = base_m + self.profile.position_m(steps)
            case "M":
                self._move()
            case "V":
                self._need_power()
                self._velocity = self._number(argument, self.profile.largest_speed, signed=True)
                self._attained = self._homing = False
            case "HO":
                wanted = 0 if argument is None else self._number(argument, self.profile.largest_position, signed=True)
                self._origin_m = self.servo.position_m - self.profile.position_m(wanted)
            case "GOHOSEQ":
                if self.reference_switch_m is None:
                    raise _Refused(NOT_AVAILABLE)
                self._need_power()
                self._loaded_m, self._velocity = None, None
                self._homing, self._attained, self._target_m = True, False, self.reference_switch_m
            case "HOSP":
                settings.homing_speed = self._number(argument, self.profile.largest_speed)
            case "NP":
                if argument is None:
                    self._notify_end = True
                else:
                    self._notify_at_m = self._place_m(argument)
            case "NPOFF":
                self._notify_end, self._notify_at_m = False, None
            case "NV":
                wanted = (self._velocity or 0) if argument is None else argument
                self._notify_speed_m_s = self.profile.speed_m_s(wanted)
            case "NVOFF":
                self._notify_speed_m_s = None
            case "SP":
                settings.speed = self._number(argument, self.profile.largest_speed)
            case "AC":
                settings.acceleration = self._number(argument, self.profile.largest_acceleration, least=1)
            case "DEC":
                settings.braking = self._number(argument, self.profile.largest_acceleration, least=1)
            case "LL":
                limit = self._number(argument, self.profile.largest_position, signed=True)
                if limit > 0:
                    settings.positive_limit = limit
                elif limit < 0:
                    settings.negative_limit = limit
                else:
                    raise _Refused(INVALID_PARAMETER)  # Assumed: zero has no sign that picks a limit.
            case "APL":
                settings.limits_on = bool(self._number(argument, 1))
            case "CORRIDOR":
                settings.corridor = self._number(argument, 32767)
            case "DEV":
                settings.deviation = self._number(argument, 32767)
            case "LPC":
                settings.peak_current = self._number(argument, self.profile.largest_current)
            case "LCC":
                settings.continuous_current = self._number(argument, self.profile.largest_current)
            case "SOR":
                if self._number(argument, 4) != 0:
                    raise _Refused(NOT_AVAILABLE)  # Only speeds from RS232 are modelled.
            case "NODEADR":
                settings.node = self._number(argument, 255)
            case "ANSW":
                settings.answer_mode = self._number(argument, 2)
            case "BAUD":
                if argument not in BAUDS:
                    raise _Refused(INVALID_PARAMETER)
                settings.baud = argument
                return ""  # The answer at the new rate is in no source.
            case "SAVE" | "EEPSAV":
                if "flash defect" in self._faults:
                    return FLASH_DEFECT
                self._saved = replace(settings)
                return SAVED
            case "RESET":
                self._power_on()
                return ""  # Assumed.
            case _:
                raise _Refused(UNKNOWN_COMMAND)
        return OK

    def _move(self) -> None:
        self._need_power()
        if self._loaded_m is not None:
            lower, upper = self._limits_m()
            # Assumed: a target beyond the limits is approached as far as they allow.
            target_m = min(max(self._loaded_m, lower), upper) if self.settings.limits_on else self._loaded_m
            self._loaded_m, self._target_m = None, target_m
        self._velocity, self._attained, self._homing = None, False, False

    def _need_power(self) -> None:
        if not self._enabled:
            raise _Refused(OVERTEMPERATURE if "motor fault" in self._faults else NOT_AVAILABLE)  # Assumed.

    @staticmethod
    def _number(argument: int | None, largest: int, *, signed: bool = False, least: int = 0) -> int:
        if argument is None or not (-largest if signed else least) <= argument <= largest:
            raise _Refused(INVALID_PARAMETER)
        return argument

    def _query(self, name: str) -> Callable[[], str] | None:
        settings, profile, servo = self.settings, self.profile, self.servo
        hot = "motor fault" in self._faults

        def ost() -> str:
            away = abs(self._reference.position_m - servo.position_m)
            status = OperationStatus(0)
            for on, bit in (
                (self._homing, OperationStatus.HOMING),
                (servo.limited, OperationStatus.CURRENT_LIMITATION),
                (away > profile.position_m(settings.deviation), OperationStatus.DEVIATION_ERROR),
                (hot, OperationStatus.OVERTEMPERATURE),
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
            "GN": lambda: str(round(servo.speed_m_s / profile.speed_m_s(1.0))),
            # Without sign (assumed).
            "GRC": lambda: str(round(abs(servo.current_a) / profile.current_a(1.0))),
            "GCL": lambda: str(round(self._limit_a() / profile.current_a(1.0))),
            "TEM": lambda: str(round(self.temperature_c)),
            "VER": lambda: "EMULATOR",
            "GTYP": lambda: profile.name,
            "GSER": lambda: "0",
            "OST": ost,
            "CST": cst,
            "GST": lambda: f"{int(self._velocity is None)}00{int(self._enabled)}{int(self._attained)}00",
            "GFS": lambda: f"{int(hot)}{int(servo.limited)}00",
            "GPL": lambda: str(settings.positive_limit),
            "GNL": lambda: str(settings.negative_limit),
            "GSP": lambda: str(settings.speed),
            "GAC": lambda: str(settings.acceleration),
            "GDEC": lambda: str(settings.braking),
            "GPC": lambda: str(settings.peak_current),
            "GCC": lambda: str(settings.continuous_current),
            "GCORRIDOR": lambda: str(settings.corridor),
            "GDEV": lambda: str(settings.deviation),
        }
        return found.get(name)
