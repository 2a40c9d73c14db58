"""Emulator of the motor's drive on its line: answers bytes with bytes at times passed in, without input or output.

A :class:`tactbench.plugin.devices.DeviceEmulator`.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
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
from tactbench.rigs.parallel_manipulator.motor.drive import STOPS_M, Drive, Load, Refused
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions

ANSWER_S = 1e-3
"""Time from the end of a command to the start of its answer [s] (assumed)."""
TICK_S = 1e-3
"""Period of the emulator's events while the motor moves [s]."""
BEYOND_M = 2e-3
"""Distance of an emulated motor's end stops from the ends of travel in its options [m] (assumed)."""


@dataclass(frozen=True)
class MotorFault(Fault):
    """A fault of the drive or its line."""

    known: ClassVar[Mapping[str, str]] = {
        "motor-fault": "too hot: without power until the fault is over and the drive is enabled again",
        "late-answers": "answers, but not notices, come later by delay_s",
        "garbled-line": "one byte of a line is replaced by another",
    }
    delay_s: float = 0.25
    """Delay by the fault [s]: seven times the longest answer at 9600 baud."""


class MotorEmulator(DeviceEmulator):
    """Emulated drive with its motor, and the speed of its serial line.

    Parameters
    ----------
    load
        Function of the force on the motor; None: no force at any time.
    rng
        Random generator for the bytes of garbled lines.
    options
        Options: units of the drive, rate of its line, and position of the home.
    stops_m
        Mechanical ends of travel [m], relative to the place at power-on.
    faults
        Faults of the drive; may be changed at any time.
    """

    def __init__(
        self,
        load: Load | None,
        rng: np.random.Generator,
        options: FaulhaberOptions | None = None,
        *,
        stops_m: tuple[float, float] = STOPS_M,
        faults: Iterable[MotorFault] = (),
    ) -> None:
        options = options or FaulhaberOptions()
        self.drive = Drive(load, options, stops_m)
        self.faults = list(faults)
        homed_at_m = stops_m[options.homes_towards() > 0] if options.homes_towards() else 0.0
        self._begins_m = options.home_m - homed_at_m
        self._byte_s = line_time_s(1, options.baud)
        self._rng = rng
        self._seen: Counter[Fault] = Counter()
        self._reader = CommandReader()
        self._now_s = self._in_free_s = self._out_free_s = -math.inf
        self._in: deque[tuple[float, bytes]] = deque()
        self._out: deque[tuple[float, bytes]] = deque()
        self._answered_s = -math.inf

    @property
    def position_m(self) -> float:
        """Position of the motor in the coordinate of its driver after homing [m]."""
        return self.drive.position_m + self._begins_m

    def press_against(self, force_n: Callable[[float], float] | None) -> None:
        """Let a force [N], given as function of :attr:`position_m`, act on the motor; None: no force."""
        self.drive.load = None if force_n is None else lambda at_m: force_n(at_m + self._begins_m)

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
                self._execute(command, at_s)
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
        hot = self._active("motor-fault", now_s) is not None
        if hot and not self.drive.hot:
            self.drive.lose_power()
            self._send("f", now_s)
        self.drive.hot = hot

    def _active(self, name: str, at_s: float) -> MotorFault | None:
        return next((fault for fault in self.faults if fault.name == name and fault.active(at_s)), None)

    def _execute(self, command: Command, at_s: float) -> None:
        try:
            answer = self.drive.answer(command)
        except Refused as refusal:
            answer = str(refusal)
        late = self._active("late-answers", at_s)
        # Answers keep the order of their commands, also when the fault ends between two of them.
        self._answered_s = max(self._answered_s, at_s + ANSWER_S + (late.delay_s if late else 0.0))
        self._send(answer, self._answered_s)

    def _send(self, text: str, at_s: float) -> None:
        line = bytearray(text.encode("ascii") + b"\r\n")
        if fault_concerns(self.faults, "garbled-line", at_s, self._seen):
            # Any other byte than the right one, also a digit for a digit, which no host can notice.
            line[int(self._rng.integers(len(line)))] ^= int(self._rng.integers(1, 256))
        first_s = max(self._out_free_s, at_s) + self._byte_s
        self._out_free_s = first_s + (len(line) - 1) * self._byte_s
        # A host stamps a line at its first byte, and has it at its last.
        self._out += [(first_s, bytes(line[:1])), (self._out_free_s, bytes(line[1:]))]


def build(settings: EmulatorSettings) -> MotorEmulator:
    """Return an emulated drive; raises UsageError for unknown options or faults."""
    options = read_options(FaulhaberOptions, settings.options, "faulhaber")
    low, high = STOPS_M
    if options.homing == "here" and options.lower_m is not None and options.upper_m is not None:
        # It has the stated travel, counted from its present place, and a little more.
        low = min(low, options.lower_m - options.home_m - BEYOND_M)
        high = max(high, options.upper_m - options.home_m + BEYOND_M)
    if options.homes_towards() < 0 and options.retreat_m is not None and options.upper_m is not None:
        # It begins at its place of retreat, away from the end stop.
        low, high = options.home_m - options.retreat_m, options.upper_m - options.retreat_m + BEYOND_M
    faults = [MotorFault.parse(text) for text in settings.faults]
    return MotorEmulator(None, settings.rng, options, stops_m=(low, high), faults=faults)
