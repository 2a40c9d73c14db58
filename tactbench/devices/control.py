"""The control loop of a press: a beat (sign of life) to the guard each period, in virtual time or in a thread.

Each beat carries a step of the press, so the guard retreats if the controller hangs.
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
"""Timeout for the end of the control thread [s] (assumed: a control period and an answer of the guard's process)."""


class Control:
    """Loop that advances a press in each control period and sends its commands to the guard.

    Parameters
    ----------
    guard
        Guard of the axes, to be armed right before :meth:`carry` or :meth:`start`.
    limits
        Limits with which the guard was armed.
    armed
        Report that the guard returned when armed.
    press
        Press to carry out.
    received
        Function that returns the number of rows received from the sensor so far.
    clock
        The rig's clock [ns].
    period_s
        Control period [s].
    stale_s
        Longest permitted time without a new row of the sensor [s].
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
        """Number of control periods that began more than one period late."""
        self._guard, self._limits, self._received, self._clock = guard, limits, received, clock
        self._period_ns, self._stale_ns = round(1e9 * period_s), round(1e9 * stale_s)
        self.report = armed
        """Last report received from the guard."""
        self._rows, self._rows_ns = -1, clock()
        self._next_ns = self._rows_ns + self._period_ns
        self._raw: list[float] = []
        self._blocks: deque[Block] = deque()
        self._events: deque[Event] = deque()
        self._over = threading.Event()
        self._stop = ""
        self._thread: threading.Thread | None = None
        self.counts: Mapping[str, Mapping[str, int]] = {}
        """Event counts of guard, axes and force sensor, as of the last control period."""

    def blocks(self) -> Iterator[Block]:
        """Yield the blocks of force sensor and motor received since the last call."""
        while self._blocks:
            yield self._blocks.popleft()

    def events(self) -> Iterator[Event]:
        """Yield the guard's events since the last call."""
        while self._events:
            yield self._events.popleft()

    def carry(self, until_ns: int) -> None:
        """Advance virtual time to `until_ns` of the clock, sending a beat in each control period."""
        while self._next_ns <= until_ns:
            self._guard.advance(self._next_ns)
            self._period()
        self._guard.advance(until_ns)

    def start(self) -> None:
        """Send beats in real time from a separate thread, until :meth:`stop`."""
        self._thread = threading.Thread(target=self._run, name="force control", daemon=True)
        self._thread.start()

    def retreat(self, why: str, within_s: float) -> None:
        """Let the motor retreat from the next control period on; return when the retreat has ended or time is over."""
        self._stop = self._stop or why
        until_ns = self._clock() + round(1e9 * within_s)
        while not self.press.over and self._clock() < until_ns:
            if self._thread is None:
                self.carry(self._next_ns)
            else:
                self._over.wait(1e-9 * self._period_ns)

    def stop(self) -> None:
        """End the control thread, if one runs; afterwards the caller may use the guard."""
        self._over.set()
        if self._thread is not None:
            self._thread.join(STOP_S)
        with suppress(TactbenchError):  # a guard that is lost
            self._gather()

    def _run(self) -> None:
        try:
            while not self._over.is_set():
                self._guard.advance(self._next_ns)
                self._period()
        except Exception as error:
            self.press.fail(fault_text(error))
            self.press.abandon()

    def _gather(self) -> None:
        guard = self._guard
        for block in guard.force_blocks:
            self._raw += self._limits.pressing_n(block.data).tolist()
        self._blocks += [*guard.force_blocks, *guard.motor_blocks]
        self._events += guard.events
        for items in (guard.force_blocks, guard.motor_blocks, guard.events):
            items.clear()
        self.counts = guard.counts

    def _period(self) -> None:
        now_ns = self._clock()
        late_ns = now_ns - self._next_ns
        self.late += late_ns > self._period_ns
        rows = self._received()
        # If this process hung, the reading of the sensor hung with it.
        if rows != self._rows or late_ns > self._stale_ns:
            self._rows, self._rows_ns = rows, now_ns
        self._next_ns = max(self._next_ns + self._period_ns, now_ns + self._period_ns // 2)
        press = self.press
        if 1e-9 * late_ns > self._limits.heartbeat_s:
            press.fail(f"the control program was held up for {1e-9 * late_ns:.1f} s")
        if late_ns > self._period_ns:  # the last report is outdated
            self.report = self._guard.beat(Beat(now_ns, str(press.state)))
        self._gather()
        raw, self._raw = self._raw, []
        if self._stop:
            press.fail(self._stop)
        if now_ns - self._rows_ns > self._stale_ns:
            press.fail(f"no row of the sensor has come for {1e-6 * (now_ns - self._rows_ns):.0f} ms")
        try:
            beat = press.step(self.report, raw, 1e-9 * now_ns)
        except TactbenchError as error:
            press.fail(fault_text(error))
            beat = press.step(self.report, (), 1e-9 * now_ns)
        number = self.report.force_sequence
        beat = replace(beat, t_ns=now_ns, state=str(press.state), force_sequence=number)
        self.report = self._guard.beat(beat)
