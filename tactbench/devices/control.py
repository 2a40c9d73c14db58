"""The loop that beats the guard: a control period at a time, in virtual time or in a thread of its own.

A beat is a step of the press, so a controller that hangs is a beat that does not come, and the guard retreats.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace

from tactbench.core.errors import TactbenchError
from tactbench.core.samples import Block
from tactbench.devices.driver import fault_text
from tactbench.devices.guard_messages import Beat, Event, Limits, Report
from tactbench.devices.guard_process import Guard
from tactbench.devices.press import Press
from tactbench.links.link import Clock

STOP_S = 10.0
"""The thread is waited for so long (assumed: a control period, and what a guard in another process takes to answer)."""


class Control:
    """Beats a guard with the steps of a press.

    Parameters
    ----------
    guard
        Armed right before :meth:`carry` or :meth:`start` is called.
    limits
        What it was armed with.
    armed
        What it answered.
    press
        What is done.
    received
        Returns how many rows of the sensor have come; while it stays the same they become old.
    clock
        The rig's.
    period_s
        Control period.
    stale_s
        How old they may be.
    """

    def __init__(
        self,
        guard: Guard,
        limits: Limits,
        armed: Report,
        press: Press,
        received: Callable[[], int],
        clock: Clock,
        *,
        period_s: float,
        stale_s: float,
    ) -> None:
        self.press = press
        self.late = 0
        """Control periods that began more than one period late."""
        self._guard, self._limits, self._received, self._clock = guard, limits, received, clock
        self._period_ns, self._stale_ns = round(1e9 * period_s), round(1e9 * stale_s)
        self.report = armed
        """What the guard answered last."""
        self._rows, self._rows_ns = -1, clock()
        self._next_ns = self._rows_ns + self._period_ns
        self._raw: list[float] = []
        self._blocks: deque[Block] = deque()
        self._events: deque[Event] = deque()
        self._over = threading.Event()
        self._stop = ""
        self._thread: threading.Thread | None = None
        self._counts: Mapping[str, Mapping[str, int]] = {}

    def blocks(self) -> Iterator[Block]:
        """Yield what force sensor and motor have sent and was not yet yielded."""
        while self._blocks:
            yield self._blocks.popleft()

    def events(self) -> Iterator[Event]:
        """Yield what has happened and was not yet yielded."""
        while self._events:
            yield self._events.popleft()

    def carry(self, until_ns: int) -> None:
        """Let time go on until a nanosecond of the clock, beating whenever it is due: for virtual time."""
        while self._next_ns <= until_ns:
            self._guard.advance(self._next_ns)
            self._period()
        self._guard.advance(until_ns)

    def start(self) -> None:
        """Beat from a thread of its own, until :meth:`stop`: for real time."""
        self._thread = threading.Thread(target=self._run, name="force control", daemon=True)
        self._thread.start()

    def retreat(self, why: str, within_s: float) -> None:
        """Let the motor retreat from the next control period on; return when it has ended, or the time is over."""
        self._stop = self._stop or why
        until_ns = self._clock() + round(1e9 * within_s)
        while not self.press.over and self._clock() < until_ns:
            if self._thread is None:
                self.carry(self._next_ns)
            else:
                self._over.wait(1e-9 * self._period_ns)

    def stop(self) -> None:
        """End the thread, if there is one; the guard may be used by the caller then."""
        self._over.set()
        if self._thread is not None:
            self._thread.join(STOP_S)
        with suppress(TactbenchError):  # a guard that is lost has nothing more to say
            self._gather()

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Return what guard, motor and force sensor had counted in the last control period."""
        return self._counts

    def _run(self) -> None:
        try:
            while not self._over.is_set():
                self._guard.advance(self._next_ns)
                self._period()
        except Exception as error:
            self.press.fail(fault_text(error))
            self.press.abandon()

    def _gather(self) -> None:
        for block in self._guard.force_blocks():
            self._blocks.append(block)
            self._raw += self._limits.pressing_n(block.data).tolist()
        self._blocks.extend(self._guard.motor_blocks())
        self._events.extend(self._guard.events())
        self._counts = self._guard.counts()

    def _period(self) -> None:
        now_ns = self._clock()
        late_ns = now_ns - self._next_ns
        self.late += late_ns > self._period_ns
        rows = self._received()
        # Where it was this process that hung, the sensor's reading hung with it.
        if rows != self._rows or late_ns > self._stale_ns:
            self._rows, self._rows_ns = rows, now_ns
        self._next_ns = max(self._next_ns + self._period_ns, now_ns + self._period_ns // 2)
        press = self.press
        if 1e-9 * late_ns > self._limits.heartbeat_s:
            press.fail(f"the program stood still for {1e-9 * late_ns:.1f} s")
        if late_ns > self._period_ns:  # what was reported then is not how it is now
            self.report = self._guard.beat(Beat(now_ns, str(press.state)))
        self._gather()
        raw, self._raw = self._raw, []
        if self._stop:
            press.fail(self._stop)
        if now_ns - self._rows_ns > self._stale_ns:
            press.fail(f"the sensor has sent nothing for {1e-6 * (now_ns - self._rows_ns):.0f} ms")
        try:
            beat = press.step(self.report, raw, 1e-9 * now_ns)
        except TactbenchError as error:
            press.fail(fault_text(error))
            beat = press.step(self.report, (), 1e-9 * now_ns)
        number = self.report.force_sequence
        beat = replace(beat, t_ns=now_ns, state=str(press.state), force_sequence=number)
        self.report = self._guard.beat(beat)
