"""The guard's process: serves one rig from a local guard, and goes on when that rig is gone.

One thread: what the rig says, then one look of the guard, and so on. It waits for the rig nowhere; what the rig does
not take is kept up to a bound, then dropped and counted. SIGINT and SIGHUP are ignored, SIGTERM means: retreat, and
leave. Started by :mod:`~.guard_process`, which has the rest.
"""

from __future__ import annotations

import gc
import json
import os
import selectors
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO, Any

from tactbench.plugin import TactbenchError, load_object
from tactbench.plugin.devices import Clock, DriverSettings, open_link
from tactbench.rigs.parallel_manipulator.guard import LOOK_S, LocalGuard
from tactbench.rigs.parallel_manipulator.guard_interface import (
    Beat,
    Event,
    GuardRefusesError,
    GuardState,
    Limits,
    Report,
    Trigger,
)
from tactbench.rigs.parallel_manipulator.guard_messages import (
    FORCE,
    MOTOR,
    MessageReader,
    ProcessSettings,
    encode_block,
    encode_message,
)
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.retreat import retreat_blind, stand_blind
from tactbench.rigs.parallel_manipulator.options import read_options

MOST_BYTES = 4 << 20
"""Of samples kept for a rig that does not take them: some 50 s of a force sensor at 1 kHz (derived: 78 bytes a row)."""
MOST_REPORTS = 1 << 18
"""Bytes of reports and events kept for it."""
AGE_STEP_S = 0.05
"""Wait for the rig's first words, and its last."""


class _Server:
    """The loop, around a guard."""

    def __init__(self, control: socket.socket, data: socket.socket) -> None:
        self._control, self._data = control, data
        control.setblocking(False)
        data.setblocking(False)
        self._reader = MessageReader()
        self._out, self._out_data = bytearray(), bytearray()
        self._guard: LocalGuard | None = None
        self._options: FaulhaberOptions | None = None
        self._opener: Callable[[], Any] | None = None
        self._clock: Clock = time.monotonic_ns
        self._log: IO[str] | None = None
        self._parent: int | None = None
        self._alone = self._over = False
        self._alone_reported = self._arming = False
        self._dropped_rows = self._dropped_reports = 0
        self.terminated = False

    def run(self) -> None:
        """Serve until the rig says `close` or is gone, or SIGTERM."""
        while not self._over:
            self._hear()
            self._flush()
            guard = self._guard
            if guard is None:
                if self._left():
                    return
                self._rest(AGE_STEP_S)
                continue
            guard.look(LOOK_S)
            self._forward(guard)
            if self._left():
                self._tell_why(guard)
                if guard.state not in (GuardState.ARMED, GuardState.RETREATING):
                    return

    def close(self) -> None:
        """Close the devices and the log."""
        if self._guard is not None:
            with suppress(TactbenchError):
                self._guard.close()
            self._write({"left": self._clock(), "rows_dropped": self._dropped_rows})
        self._flush()
        if self._log is not None:
            self._log.close()

    def rescue(self) -> None:
        """After an error within the guard: write it down; an armed motor retreats, one that is being homed stands."""
        self._write({"internal_error": traceback.format_exc()})
        guard = self._guard
        armed = guard is not None and guard.state in (GuardState.ARMED, GuardState.RETREATING)
        if guard is None or self._opener is None or not (armed or self._arming):
            return
        assert self._options is not None
        guard.abandon()
        with suppress(TactbenchError):
            if armed and not self._arming:
                position_m = retreat_blind(self._opener, self._options, self._clock, 10.0)
                self._write({"retreated_to_m": position_m})
            else:
                stand_blind(self._opener, self._options, self._clock)
                self._write({"stands": self._clock()})

    def _left(self) -> bool:
        """Return whether the process is to end."""
        if self._parent is not None and os.getppid() != self._parent:
            self._alone = True
        return self._alone or self.terminated

    def _tell_why(self, guard: LocalGuard) -> None:
        if self._alone_reported:
            return
        self._alone_reported = True
        if self.terminated:
            guard.trip(Trigger.TERMINATED, "the guard's process was told to end")
        else:
            guard.trip(Trigger.RIG_LOST, "the rig's process has ended")
        self._write({"leaving": self._clock(), "terminated": self.terminated, "rig_lost": self._alone})

    def _rest(self, seconds: float) -> None:
        with selectors.DefaultSelector() as selector:
            if not self._alone:
                selector.register(self._control, selectors.EVENT_READ)
            selector.select(seconds)

    def _interrupted(self) -> bool:
        """Return whether homing is to end: asked between two answers of the motor."""
        with suppress(BlockingIOError):
            try:
                self._alone |= self._control.recv(1, socket.MSG_PEEK) == b""
            except ConnectionError:
                self._alone = True
        return self._left()

    def _hear(self) -> None:
        while not self._alone:
            try:
                data = self._control.recv(1 << 16)
            except BlockingIOError:
                return
            except ConnectionError:
                data = b""
            if not data:
                self._alone = True
                return
            for kind, body in self._reader.feed(data):
                self._carry_out(kind, body)

    def _carry_out(self, kind: str, body: dict[str, Any]) -> None:
        guard = self._guard
        try:
            if kind == "start":
                self._start(body)
            elif kind == "close":
                self._over = True
            elif guard is None:
                raise GuardRefusesError("The guard was not started.", hint="Use start().")
            elif kind == "beat":
                self._answer_report(guard.beat(Beat(**body)))
            elif kind == "arm":
                self._arming = True
                report = guard.arm(Limits(**body))
                self._arming = False
                self._answer_report(report)
            elif kind == "disarm":
                self._answer_report(guard.disarm())
            elif kind == "counts":
                counts = {name: dict(values) for name, values in guard.counts().items()}
                counts["guard"] |= {"rows_dropped": self._dropped_rows, "reports_dropped": self._dropped_reports}
                self._answer("counts", counts)
        except TactbenchError as error:
            self._arming = False
            self._answer("error", {"kind": type(error).__name__, "message": error.message, "hint": error.hint})

    def _start(self, body: dict[str, Any]) -> None:
        self._parent = body.pop("parent")
        settings = ProcessSettings.of(body)
        self._clock = settings.clock()
        self._log = Path(settings.log).open("a", encoding="utf-8", buffering=1)  # noqa: SIM115  (closed in `close`)
        self._write({"started": self._clock(), "unix_ns": time.time_ns(), "pid": os.getpid()})
        self._options = read_options(FaulhaberOptions, settings.motor.options, "faulhaber")
        self._opener = partial(open_link, settings.motor.link, self._clock)
        drivers = []
        for device in (settings.motor, settings.force):
            opener = partial(open_link, device.link, self._clock)
            try:
                drivers.append(
                    load_object(device.driver)(DriverSettings(opener, options=device.options, clock=self._clock))
                )
            except TactbenchError:
                for driver in drivers:
                    driver.close()
                raise
        motor, force = drivers
        guard = LocalGuard(
            motor,
            force,
            self._clock,
            lambda until_ns: self._rest(max(0.0, 1e-9 * (until_ns - self._clock()))),
            on_event=self._event,
            interrupted=self._interrupted,
        )
        try:
            identity = guard.start()
        except TactbenchError:
            guard.close()
            raise
        self._guard = guard
        streams = [guard.force_stream.model_dump_json(), guard.motor_stream.model_dump_json()]
        self._answer("started", {"identity": identity, "streams": streams})
        # What there is by now stays: collections have little to look at.
        gc.collect()
        gc.freeze()

    def _event(self, event: Event) -> None:
        body = json.loads(event.to_json())
        self._answer("event", body)
        self._write(body)

    def _answer_report(self, report: Report) -> None:
        self._answer("report", json.loads(report.to_json()))

    def _answer(self, kind: str, body: dict[str, Any]) -> None:
        line = encode_message(kind, body)
        if len(self._out) + len(line) > MOST_REPORTS:
            self._dropped_reports += 1
        else:
            self._out += line
        self._flush()

    def _forward(self, guard: LocalGuard) -> None:
        for device, blocks in ((FORCE, guard.force_blocks()), (MOTOR, guard.motor_blocks())):
            for block in blocks:
                piece = encode_block(device, block)
                if len(self._out_data) + len(piece) > MOST_BYTES:
                    self._dropped_rows += len(block.data)
                else:
                    self._out_data += piece
        guard.events()

    def _flush(self) -> None:
        for end, waiting in ((self._control, self._out), (self._data, self._out_data)):
            if not waiting or self._alone:
                continue
            with suppress(OSError):  # full, or nobody there
                del waiting[: end.send(waiting)]

    def _write(self, entry: dict[str, Any]) -> None:
        if self._log is not None:
            with suppress(OSError):
                self._log.write(json.dumps(entry) + "\n")


def main() -> int:
    """Run the process: ``python -m … CONTROL DATA``, numbers of two open sockets."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    control, data = (socket.socket(fileno=int(number)) for number in sys.argv[1:3])
    server = _Server(control, data)

    def terminate(_number: int, _frame: Any) -> None:
        server.terminated = True

    signal.signal(signal.SIGTERM, terminate)
    try:
        server.run()
    except Exception:
        server.rescue()
        return 1
    finally:
        server.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
