"""The motor's drive at the end of its line: bytes in, bytes out, on a clock that is passed in; no input or output.

A :class:`tactbench.plugin.devices.DeviceEmulator`.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tactbench.plugin import sourced
from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Sent,
    fault_concerns,
    read_options,
)
from tactbench.rigs.parallel_manipulator.motor.codec import OK, Command, CommandReader, line_time_s
from tactbench.rigs.parallel_manipulator.motor.drive import Drive, Refused
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.servo import Load, MotorModel


@dataclass(frozen=True)
class MotorFault(Fault):
    """A fault of the drive or its line."""

    known: ClassVar[Mapping[str, str]] = {
        "motor-fault": "too hot: without power until it is over and the drive is enabled again",
        "late-answers": "answers, not notices, come later by delay_s",
        "garbled-line": "one byte of a line is another one",
    }
    delay_s: float = 0.25
    """Seven times the longest answer at 9600 baud."""


BEYOND_M = 2e-3
"""How far an emulated motor goes beyond the ends of travel that its options state (assumed)."""
SWITCH_M = -8e-3
"""Where an emulated drive of a rig file has its reference switch, 2 mm from its end stop (assumed)."""


class MotorEmulator(DeviceEmulator):
    """A drive with its motor, and its line's pace. The first call is power-on.

    Parameters
    ----------
    load
        Force on the motor [N] at a position [m] and a time [s], positive against positive motion; None: none, ever.
    rng
        Draws the bytes of garbled lines.
    profile, model
        Units of the drive; mechanics of the motor.
    reference_switch_m
        Where GOHOSEQ finds its switch [m]; None: there is none, and GOHOSEQ is answered "Command not available".
    baud
        Of its line, as it was set before.
    faults
        What is wrong with it; may be changed at any time.
    """

    keeps_pace = True
    """Bytes take their time here, at the rate that the drive is set to."""

    def __init__(
        self,
        load: Load | None,
        rng: np.random.Generator,
        *,
        profile: FaulhaberOptions | None = None,
        model: MotorModel | None = None,
        reference_switch_m: float | None = None,
        baud: int = 9600,
        faults: Iterable[MotorFault] = (),
    ) -> None:
        model = model or MotorModel()
        self.drive = Drive(load, profile or FaulhaberOptions(), model, reference_switch_m)
        self.faults = list(faults)
        self.begins_m = 0.0
        """Where the motor stands at power-on, as its driver counts once it has homed it."""
        self.drive.settings.baud = baud
        self._answer_time_s = model.answer_time.to("s")
        self._rng = rng
        self._seen: Counter[Fault] = Counter()
        self._reader = CommandReader()
        self._start_s: float | None = None
        self._now_s = self._in_free_s = self._out_free_s = -math.inf
        self._ticks = 0
        self._in: deque[tuple[float, bytes]] = deque()
        self._answers: deque[tuple[float, str]] = deque()
        self._out: deque[tuple[float, bytes]] = deque()

    @property
    def position_m(self) -> float:
        """Where the motor is, as its driver counts once it has homed it [m]."""
        return self.drive.servo.position_m + self.begins_m

    def press_against(self, force_n: Callable[[float], float] | None) -> None:
        """Let a force [N] at such a position act on the motor; None: none, ever."""
        self.drive.servo.load = None if force_n is None else lambda at_m, _: force_n(at_m + self.begins_m)

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[Sent]:
        """Take bytes that the host sends from `now_s` on, at the line's rate; return what `poll` returns.

        Times do not go back: an earlier one counts as the latest seen.
        """
        assert isinstance(piece, bytes)
        now_s = max(now_s, self._now_s)
        byte_s = line_time_s(1, self.drive.settings.baud)
        self._in_free_s = max(self._in_free_s, now_s)
        for part in piece.splitlines(keepends=True):
            self._in_free_s += len(part) * byte_s
            self._in.append((self._in_free_s, part))
        return self.poll(now_s)

    def poll(self, now_s: float) -> list[Sent]:
        """Go on to `now_s`; return what has left the drive by then, of each line the first byte and the rest."""
        if self._start_s is None:
            self._start_s = now_s
        now_s = max(now_s, self._now_s)
        while self._in and self._in[0][0] <= now_s:
            at_s, part = self._in.popleft()
            self._go_to(at_s)
            for command in self._reader.feed(part):
                self._carry_out(command, at_s)
        self._go_to(now_s)
        found: list[Sent] = []
        while self._out and self._out[0][0] <= now_s:
            found.append(self._out.popleft())
        return found

    def next_s(self) -> float:
        """Return when something may happen next: a command in, an answer, a line out, a tick; 0 before power-on."""
        if self._start_s is None:
            return 0.0
        next_s = math.inf if self._standing else self._tick_s()
        for queue in (self._in, self._answers, self._out):
            if queue:
                next_s = min(next_s, queue[0][0])
        return next_s

    @property
    def _standing(self) -> bool:
        """Whether a tick changes nothing until a command comes."""
        return self.drive.standing and not any(fault.name == "motor-fault" for fault in self.faults)

    def _tick_s(self) -> float:
        """Return the time of the next tick."""
        assert self._start_s is not None
        return self._start_s + (self._ticks + 1) * self.drive.servo.tick_s

    def _go_to(self, now_s: float) -> None:
        # Ticks stand on a grid of their own, and answers have their times: when it is asked for changes nothing.
        while True:
            tick_s = self._tick_s()
            if tick_s <= now_s and self._standing:
                assert self._start_s is not None
                # One tick is left to be made: rounding then decides nothing.
                self._ticks += max(0, math.floor((now_s - self._start_s) / self.drive.servo.tick_s) - 1 - self._ticks)
                tick_s = self._tick_s()
            if self._answers and self._answers[0][0] <= min(tick_s, now_s):
                due_s, text = self._answers.popleft()
                self._send(text, due_s)
            elif tick_s <= now_s:
                self._ticks += 1
                self._heat(tick_s)
                for letter in self.drive.tick(tick_s):
                    self._notice(letter, tick_s)
            else:
                break
        self._now_s = now_s

    def _active(self, name: str, at_s: float) -> MotorFault | None:
        return next((fault for fault in self.faults if fault.name == name and fault.active(at_s)), None)

    def _heat(self, at_s: float) -> None:
        hot = self._active("motor-fault", at_s) is not None
        if hot and not self.drive.hot:
            self.drive.overheat()
            self._notice("f", at_s)
        self.drive.hot = hot

    def _carry_out(self, command: Command, at_s: float) -> None:
        if command.node not in (None, self.drive.settings.node):
            return
        try:
            answer = self.drive.answer(command)
            refused = False
        except Refused as refusal:
            answer, refused = str(refusal), True
        # Without ANSW2 queries and SAVE are answered, and nothing else (assumed).
        silent = self.drive.settings.answer_mode < 2 and (refused or answer == OK)
        if answer and not silent:
            late = self._active("late-answers", at_s)
            due_s = at_s + self._answer_time_s + (late.delay_s if late else 0.0)
            # Answers keep the order of their commands, also when the fault ends between two of them.
            self._answers.append((max(due_s, self._answers[-1][0]) if self._answers else due_s, answer))

    def _notice(self, letter: str, at_s: float) -> None:
        if self.drive.settings.answer_mode:
            self._send(letter, at_s)

    def _send(self, text: str, at_s: float) -> None:
        line = bytearray(text.encode("ascii") + b"\r\n")
        if fault_concerns(self.faults, "garbled-line", at_s, self._seen):
            # Any other byte than the right one: also a digit for a digit, which no host can notice.
            line[int(self._rng.integers(len(line)))] ^= int(self._rng.integers(1, 256))
        byte_s = line_time_s(1, self.drive.settings.baud)
        first_s = max(self._out_free_s, at_s) + byte_s
        self._out_free_s = first_s + (len(line) - 1) * byte_s
        # A host stamps a line at its first byte, and has it at its last.
        self._out += [(first_s, bytes(line[:1])), (self._out_free_s, bytes(line[1:]))]


def build(settings: EmulatorSettings) -> MotorEmulator:
    """Return an emulated drive; `settings.senses` may give the ``load`` on its motor, N against positive motion.

    Raises
    ------
    UsageError
        For options or faults that are not known.
    """
    options = read_options(FaulhaberOptions, settings.options, "faulhaber")
    model = MotorModel()
    if options.homing == "here" and options.lower_m is not None and options.upper_m is not None:
        # It has the travel that is stated, counted from where it stands now, and a little more.
        ends_m = (options.lower_m - options.home_m - BEYOND_M, options.upper_m - options.home_m + BEYOND_M)
        first, last = (end.to("m") for end in model.travel)
        travel = (sourced(min(ends_m[0], first), "m", "its options"), sourced(max(ends_m[1], last), "m", "its options"))
        model = model.model_copy(update={"travel": travel})
    found = MotorEmulator(
        lambda _position_m, at_s: settings.senses(at_s).get("load", 0.0),
        settings.rng,
        profile=options,
        model=model,
        reference_switch_m=SWITCH_M if options.homing == "switch" else None,
        baud=options.baud,
        faults=[MotorFault.parse(text) for text in settings.faults],
    )
    ends = found.drive.servo.stops
    homed_at_m = {"here": 0.0, "switch": SWITCH_M, "end-stop": ends[options.homes_towards() > 0]}[options.homing]
    found.begins_m = options.home_m - homed_at_m
    return found
