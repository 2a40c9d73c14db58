"""The guard in a separate process, which owns the links of all axes and of the force sensor, and outlives its rig.

The rig holds a :class:`GuardProcess`. The process is started in its own session, so that Ctrl-C at the terminal does
not reach it; it ignores SIGINT and SIGHUP, and on SIGTERM it retreats and ends. In one thread it alternately serves
requests of the rig and checks all devices; it never waits for the rig. Each answer carries the samples and events
since the answer before. Requests and answers are pickled by :mod:`multiprocessing.connection`.

When the rig dies, the process retreats, logs the retreat and ends. It detects this by the end of the connection, by
its parent's process id, or, if another process keeps the connection open or the rig only hangs, by the age of the
last beat. When the process dies or does not answer a beat within heartbeat_s, the rig's side kills it, opens the
axes' links and sends the same retreat, provided that the rig calls :meth:`GuardProcess.beat` or
:meth:`GuardProcess.advance`. If both die, each axis ends its last move and holds.

Needs sessions and signals of POSIX.
"""

from __future__ import annotations

import gc
import json
import math
import os
import pkgutil
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, NoReturn, TypeAlias

from tactbench.core.errors import LinkClosed, LinkError, RigError, TactbenchError, UsageError
from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import DriverSettings
from tactbench.devices.guard import LOOK_S, LocalGuard, retreat_seconds
from tactbench.devices.guard_messages import (
    Beat,
    Event,
    GuardLostError,
    GuardRefusesError,
    GuardState,
    Limits,
    Report,
    Trigger,
)
from tactbench.links.address import open_link

START_S = 60.0
"""Timeout for the start of the process and of all devices [s] (assumed: imports on a busy machine)."""
ARM_S = 180.0
"""Timeout for homing and retracting the axes [s]."""
OPEN_S = 1.0
"""Timeout for a port still open in another process [s] (assumed; measured: free 5 ms after that process is killed)."""
MESSAGE_S = 0.5
"""Timeout for the rest of a partly sent message [s]: its sender or receiver has stopped (assumed)."""
IDLE_S = 0.05
"""Wait for a request before the devices are open [s]."""


@dataclass(frozen=True)
class DeviceSettings:
    """Driver, link and options of one device that the guard opens."""

    driver: str
    """Function that builds the driver, as ``module:name``."""
    link: str
    """Address of the link."""
    options: Mapping[str, Any] = field(default_factory=dict)

    def open(self) -> Any:
        """Return the driver; raises LinkError if the link cannot be opened within `OPEN_S`."""
        build = pkgutil.resolve_name(self.driver)
        until_s = time.monotonic() + OPEN_S
        while True:
            try:
                return build(DriverSettings(partial(open_link, self.link), options=self.options))
            except LinkError as error:
                if isinstance(error, LinkClosed) or time.monotonic() > until_s:
                    raise
                time.sleep(1e-3)


@dataclass(frozen=True)
class ProcessSettings:
    """Devices and log file of a guard's process."""

    axes: Mapping[str, DeviceSettings]
    """Settings by axis name; the pressing axis is the first."""
    force: DeviceSettings
    log: str
    """Path of the log, to which each event is appended as one line of JSON. A file beside it, ending in ``.not-out``,
    exists while the pressing axis is not known to be clear of the sensor; the next guard reads it."""

    def rescue(self, *, retreat: bool) -> str:
        """Open the axes' links, halt all axes, and retract the pressing axis if `retreat`; return the outcome as text.

        Raises
        ------
        LinkError, RigError
            If an axis does not follow its command; all other axes were commanded before.
        """
        outcome, failed = "the axes were commanded to halt", None
        press, *others = self.axes
        for name in (*others, press):
            away = retreat and name == press
            try:
                with self.axes[name].open() as axis:
                    place = axis.rescue(retreat_seconds(axis) if away else None)
                    if away:
                        outcome = f"{name} has retreated to {place:g} m, the force there was not measured"
            except (LinkError, RigError) as error:
                failed = error
        if failed is not None:
            raise failed
        return outcome


class GuardProcess:
    """The rig's access to a guard in another process, with the methods and attributes of :class:`~.guard.LocalGuard`.

    Once the process is lost, each request raises GuardLostError. Samples, events and counts are those
    received in answers.

    Parameters
    ----------
    settings
        Drivers, links and options of the axes and the force sensor, and the path of the log.

    Raises
    ------
    UsageError
        If this system is not POSIX.
    """

    force_stream: StreamSpec
    """Stream of the force sensor, set by :meth:`start`."""
    motor_stream: StreamSpec
    """Stream of the pressing axis, set by :meth:`start`."""

    def __init__(self, settings: ProcessSettings) -> None:
        if os.name != "posix":
            raise UsageError("The guard's process needs sessions and signals of POSIX.", hint="Use Linux.")
        self._settings = settings
        self._limits: Limits | None = None
        self._requested, self._number = "", 0
        self._closed = False
        self._lost: GuardLostError | None = None
        self.force_blocks: list[Block] = []
        self.motor_blocks: list[Block] = []
        self.events: list[Event] = []
        self.counts: Mapping[str, Mapping[str, int]] = {}
        ours, theirs = socket.socketpair()
        for end in (ours, theirs):
            for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
                end.setsockopt(socket.SOL_SOCKET, option, struct.pack("ll", 0, round(1e6 * MESSAGE_S)))
        self._connection: Connection[Any, Any] = Connection(ours.detach())
        with theirs, Path(settings.log).open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", f"from {__name__} import main; main()", str(theirs.fileno())],
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Let the process open and start all devices; return their identities by device name."""
        identity, self.force_stream, self.motor_stream = self._request("start", START_S, self._settings)
        return identity  # type: ignore[no-any-return]

    def arm(self, limits: Limits) -> Report:
        """Check the limits, home and retract the axes; see :meth:`.LocalGuard.arm`."""
        self._limits = limits
        try:
            return self._request("arm", ARM_S, limits)  # type: ignore[no-any-return]
        except GuardRefusesError:
            self._limits = None
            raise

    def beat(self, beat: Beat) -> Report:
        """Send a beat and return the guard's report on it; takes some milliseconds."""
        return self._request("beat", self._timeout_s, beat)  # type: ignore[no-any-return]

    def advance(self, until_ns: int) -> None:
        """Wait until the clock has reached `until_ns`, then receive the samples and events since the last request."""
        if self._lost is None:
            self._connection.poll(max(0.0, 1e-9 * (until_ns - time.monotonic_ns())))  # its end ends the wait
        self._request("collect", self._timeout_s)

    def disarm(self) -> Report:
        """Retreat if the pressing axis has not retreated, and expect no more beats."""
        report: Report = self._request("disarm", ARM_S)
        self._limits = None
        return report

    def close(self) -> None:
        """Disarm and end the process; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        with suppress(OSError):
            self._connection.send((0, "close", None))
        try:
            self._process.wait(ARM_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        finally:
            self._connection.close()

    @property
    def _timeout_s(self) -> float:
        return START_S if self._limits is None else self._limits.heartbeat_s

    def _request(self, what: str, timeout_s: float, given: Any = None) -> Any:
        """Send a request and return its result; raises the error returned by the process, or GuardLostError."""
        if self._lost is not None:
            raise self._lost
        self._requested, self._number, number = what, self._number + 1, 0
        until_s = time.monotonic() + timeout_s
        try:
            self._connection.send((self._number, what, given))
            while number != self._number:  # an answer to an interrupted request comes before
                if not self._connection.poll(max(0.0, until_s - time.monotonic())):
                    self._fail(f"no answer within {timeout_s:.3f} s")
                number, result, force_blocks, motor_blocks, events, self.counts = self._connection.recv()
                self.force_blocks += force_blocks
                self.motor_blocks += motor_blocks
                self.events += events
        except (EOFError, OSError, UnpicklingError):
            self._fail("the connection has ended")
        if isinstance(result, TactbenchError):
            raise result
        return result

    def _fail(self, why: str) -> NoReturn:
        """Kill the process and retract the pressing axis; raises GuardLostError, as every later request does."""
        with suppress(OSError):
            self._process.kill()
        outcome, trigger = "no axis was armed, so no command was sent", Trigger.GUARD_LOST
        try:
            if self._limits is not None:
                outcome = self._settings.rescue(retreat=self._requested != "arm")
        except TactbenchError as error:
            trigger = Trigger.RETREAT_FAILED
            outcome = f"RETREAT FAILED: {error.message} Stand clear, and cut the axes' supply"
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        text = f"The guard's process is lost: {why}; {outcome}."
        self.events.append(Event(time.monotonic_ns(), GuardState.FAULT, trigger, math.nan, math.nan, text))
        self._lost = GuardLostError(text, hint=f"Its last events are in {self._settings.log}.")
        raise self._lost


Guard: TypeAlias = LocalGuard | GuardProcess
"""Guard through which a rig moves its axes: in the rig's process, or in a separate process."""


class _Server:
    """Main loop of the guard's process: serve requests of the rig, and check all devices, in turn."""

    def __init__(self, connection: Connection[Any, Any]) -> None:
        self._connection, self._parent = connection, os.getppid()
        self._guard: LocalGuard | None = None
        self._closing = self._rig_gone = self.terminated = False

    def run(self) -> None:
        """Serve until the rig sends `close` or ends, or until SIGTERM; then retreat and close the devices."""
        while not self._over():
            if self._guard is not None:
                self._guard.look(LOOK_S)
            self._serve(IDLE_S if self._guard is None else 0.0)
        if self._guard is not None:
            with suppress(TactbenchError):
                self._guard.close()
            _log({"left": time.monotonic_ns()})

    def _over(self) -> bool:
        guard = self._guard
        self._rig_gone |= os.getppid() != self._parent
        if guard is None or self._closing or not (self._rig_gone or self.terminated):
            return self._closing or self._rig_gone or self.terminated
        if self.terminated:
            guard.trip(Trigger.TERMINATED, "the guard's process received SIGTERM")
        guard.trip(Trigger.RIG_LOST, "the rig's process has ended")
        return guard.state not in (GuardState.ARMED, GuardState.RETREATING)

    def _interrupted(self) -> bool:
        """Return True if homing has to end: after SIGTERM, at the rig's end, or on `close`, the one message then."""
        return self.terminated or os.getppid() != self._parent or self._connection.poll(0)

    def _serve(self, timeout_s: float) -> None:
        try:
            while not self._rig_gone and not self._closing and self._connection.poll(timeout_s):
                number, what, given = self._connection.recv()
                self._closing = what == "close"
                if not self._closing:
                    self._connection.send((number, *self._answer(what, given)))
                timeout_s = 0.0
        except (EOFError, OSError):  # a rig that takes no answer counts as gone
            self._rig_gone = True

    def _answer(self, what: str, given: Any) -> tuple[Any, ...]:
        """Return a request's result or error, and the samples, events and counts since the last answer."""
        result: Any = None
        try:
            if what == "start":
                result = self._start(given)
            elif self._guard is None:
                raise GuardRefusesError("The guard was not started.", hint="Use start().")
            elif what != "collect":
                result = getattr(self._guard, what)(*(() if given is None else (given,)))
        except TactbenchError as error:
            result = error
        guard = self._guard
        if guard is None:
            return result, [], [], [], {}
        waiting = guard.force_blocks, guard.motor_blocks, guard.events
        answer = result, *([*items] for items in waiting), guard.counts
        for items in waiting:
            items.clear()
        return answer

    def _start(self, settings: ProcessSettings) -> Any:
        _log({"started": time.monotonic_ns(), "unix_ns": time.time_ns(), "pid": os.getpid()})
        with ExitStack() as opened:
            guard = LocalGuard(
                {name: opened.enter_context(axis.open()) for name, axis in settings.axes.items()},
                opened.enter_context(settings.force.open()),
                time.monotonic_ns,
                lambda until_ns: time.sleep(max(0.0, 1e-9 * (until_ns - time.monotonic_ns()))),
                on_event=lambda event: _log(asdict(event)),
                interrupted=self._interrupted,
                kept=Path(settings.log).with_suffix(".not-out"),
            )
            identity = guard.start()
            opened.pop_all()
        self._guard = guard
        gc.freeze()  # collections skip the objects of the imports, and take less time
        return identity, guard.force_stream, guard.motor_stream


def _log(entry: Mapping[str, Any]) -> None:
    with suppress(OSError):  # a full disk must not stop the guard
        print(json.dumps(entry), flush=True)


def main() -> None:
    """Run the guard's process; its command-line argument is the file descriptor of the connection's socket."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    server = _Server(Connection(int(sys.argv[1])))

    def terminate(_number: int, _frame: Any) -> None:
        server.terminated = True

    signal.signal(signal.SIGTERM, terminate)
    server.run()
