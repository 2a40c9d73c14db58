"""The motor's drive at the end of its line: bytes in, bytes out, on a clock that is passed in; no input or output.

A :class:`tactbench.plugin.devices.DeviceEmulator`.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Sent,
    fault_concerns,
    read_options,
)
from tactbench.rigs.parallel_manipulator.motor.codec import Command, CommandReader, line_time_s
from tactbench.rigs.parallel_manipulator.motor.drive import Drive, Load, MotorModel, Refused
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions


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
        Force on the motor; None: none, ever.
    rng
        Draws the bytes of garbled lines.
    profile, model
        Units of the drive; mechanics of the motor.
    reference_switch_m
        Where GOHOSEQ finds its switch [m]; None: there is none, and GOHOSEQ is answered "Command not available".
    baud
        Of its line.
    faults
        What is wrong with it; may be changed at any time.
    """

    keeps_pace = True
    """Bytes take their time here."""

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
        self._byte_s, self._tick_long_s, self._answer_time_s = line_time_s(1, baud), model.tick_s, model.answer_s
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
        return self.drive.position_m + self.begins_m

    def press_against(self, force_n: Callable[[float], float] | None) -> None:
        """Let a force [N] at such a position act on the motor; None: none, ever."""
        self.drive.load = None if force_n is None else lambda at_m: force_n(at_m + self.begins_m)

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[Sent]:
        """Take bytes that the host sends from `now_s` on, at the line's rate; return what `poll` returns.

        Times do not go back: an earlier one counts as the latest seen.
        """
        assert isinstance(piece, bytes)
        now_s = max(now_s, self._now_s)
        self._in_free_s = max(self._in_free_s, now_s)
        for part in piece.splitlines(keepends=True):
            self._in_free_s += len(part) * self._byte_s
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
        return self._start_s + (self._ticks + 1) * self._tick_long_s

    def _go_to(self, now_s: float) -> None:
        # Ticks stand on a grid of their own, and answers have their times: when it is asked for changes nothing.
        while True:
            tick_s = self._tick_s()
            if tick_s <= now_s and self._standing:
                assert self._start_s is not None
                # One tick is left to be made: rounding then decides nothing.
                self._ticks += max(0, math.floor((now_s - self._start_s) / self._tick_long_s) - 1 - self._ticks)
                tick_s = self._tick_s()
            if self._answers and self._answers[0][0] <= min(tick_s, now_s):
                due_s, text = self._answers.popleft()
                self._send(text, due_s)
            elif tick_s <= now_s:
                self._ticks += 1
                self._heat(tick_s)
                self.drive.tick()
            else:
                break
        self._now_s = now_s

    def _active(self, name: str, at_s: float) -> MotorFault | None:
        return next((fault for fault in self.faults if fault.name == name and fault.active(at_s)), None)

    def _heat(self, at_s: float) -> None:
        hot = self._active("motor-fault", at_s) is not None
        if hot and not self.drive.hot:
            self.drive.overheat()
            self._send("f", at_s)
        self.drive.hot = hot

    def _carry_out(self, command: Command, at_s: float) -> None:
        try:
            answer = self.drive.answer(command)
        except Refused as refusal:
            answer = str(refusal)
        if answer:
            late = self._active("late-answers", at_s)
            due_s = at_s + self._answer_time_s + (late.delay_s if late else 0.0)
            # Answers keep the order of their commands, also when the fault ends between two of them.
            self._answers.append((max(due_s, self._answers[-1][0]) if self._answers else due_s, answer))

    def _send(self, text: str, at_s: float) -> None:
        line = bytearray(text.encode("ascii") + b"\r\n")
        if fault_concerns(self.faults, "garbled-line", at_s, self._seen):
            # Any other byte than the right one: also a digit for a digit, which no host can notice.
            line[int(self._rng.integers(len(line)))] ^= int(self._rng.integers(1, 256))
        first_s = max(self._out_free_s, at_s) + self._byte_s
        self._out_free_s = first_s + (len(line) - 1) * self._byte_s
        # A host stamps a line at its first byte, and has it at its last.
        self._out += [(first_s, bytes(line[:1])), (self._out_free_s, bytes(line[1:]))]


def build(settings: EmulatorSettings) -> MotorEmulator:
    """Return an emulated drive; raises UsageError for options or faults that are not known."""
    options = read_options(FaulhaberOptions, settings.options, "faulhaber")
    model = MotorModel()
    if options.homing == "here" and options.lower_m is not None and options.upper_m is not None:
        # It has the travel that is stated, counted from where it stands now, and a little more.
        low, high = options.lower_m - options.home_m - BEYOND_M, options.upper_m - options.home_m + BEYOND_M
        model = replace(model, stops_m=(min(low, model.stops_m[0]), max(high, model.stops_m[1])))
    found = MotorEmulator(
        None,
        settings.rng,
        profile=options,
        model=model,
        reference_switch_m=SWITCH_M if options.homing == "switch" else None,
        baud=options.baud,
        faults=[MotorFault.parse(text) for text in settings.faults],
    )
    homed_at_m = {"here": 0.0, "switch": SWITCH_M, "end-stop": model.stops_m[options.homes_towards() > 0]}
    found.begins_m = options.home_m - homed_at_m[options.homing]
    return found
