"""The guard in a process of its own: it alone has the links of axes and force sensor, and outlives its rig.

:class:`GuardProcess` is what the rig holds. The process is spawned in a session of its own, so that Ctrl-C at the
terminal does not reach it; SIGINT and SIGHUP are ignored, SIGTERM means: retreat, and leave. One thread takes requests
of the rig, then looks once, and so on; it waits for the rig nowhere. Requests and answers are lines of JSON, numbered;
lines without a number bring samples and events as they come.

When the rig dies, the process retreats, writes so to its log and leaves. It notices by the end of the socket, by its
parent's number, or, whatever holds the socket open and whether the rig is dead or only hangs, by the age of the last
beat. When the process dies or does not answer a beat within heartbeat_s, the rig's side ends it, opens the axes' lines
and sends the same retreat, as long as the rig calls :meth:`GuardProcess.beat` or :meth:`GuardProcess.advance`. If both
die, axes end the move that is out, and hold.

Needs sessions and signals of POSIX.
"""

from __future__ import annotations

import gc
import json
import math
import os
import pkgutil
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

import numpy as np
from pydantic import TypeAdapter

from tactbench.core import errors
from tactbench.core.errors import LinkClosed, LinkError, RigError, TactbenchError, UsageError
from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import DriverSettings
from tactbench.devices.guard import LOOK_S, LocalGuard, retreat_seconds, taken
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
from tactbench.links.link import Clock

START_S = 60.0
"""Within which the process is there and all devices have answered (assumed: imports of a busy machine)."""
ARM_S = 180.0
"""Within which the axes are homed and retracted."""
OPEN_S = 1.0
"""For so long a port is tried that another process still holds (assumed; free 5 ms after that was killed, measured)."""
MOST_BYTES = 1 << 20
"""Under way to a rig that does not take them: some 5 s of a force sensor at 1 kHz."""
IDLE_S = 0.05
"""Wait for the rig's first words, and its last."""


@dataclass(frozen=True)
class DeviceSettings:
    """One device that the guard opens."""

    driver: str
    """``module:build``."""
    link: str
    """Address."""
    options: Mapping[str, Any] = field(default_factory=dict)

    def open(self, clock: Clock) -> Any:
        """Return the driver."""
        build = pkgutil.resolve_name(self.driver)
        return build(DriverSettings(partial(open_link, self.link, clock), options=self.options, clock=clock))


@dataclass(frozen=True)
class ProcessSettings:
    """What a guard's process is given first."""

    axes: Mapping[str, DeviceSettings]
    """The pressing one first."""
    force: DeviceSettings
    log: str
    """A file to which events are added, one line of JSON each. One beside it, ending in ``.not-out``, is there while
    the pressing axis is not known to be clear of the sensor; the next guard begins with it."""
    clock_zero_ns: int = 0
    """``time.monotonic_ns()`` at zero of the rig's clock."""

    def clock(self) -> Clock:
        """Return the rig's clock, which every process on this machine can read."""
        return lambda: time.monotonic_ns() - self.clock_zero_ns

    def rescue(self, clock: Clock, *, retreat: bool) -> str:
        """Let the pressing axis retreat (else: stand) and the others stand, by lines that nobody holds any more.

        Raises
        ------
        LinkError, RigError
            If one does not; the rest was done before.
        """
        said, failed = "the axes were sent to stand", None
        press, *others = self.axes
        for name in (*others, press):
            try:
                axis = _opened(self.axes[name], clock)
                with axis:
                    place = axis.rescue(retreat_seconds(axis) if retreat and name == press else None)
                    if retreat and name == press:
                        said = f"{name} has retreated to {place:g} m, and the force there was not looked at"
            except (LinkError, RigError) as error:
                failed = error
        if failed is not None:
            raise failed
        return said


def _opened(settings: DeviceSettings, clock: Clock) -> Any:
    until_ns = clock() + round(1e9 * OPEN_S)
    while True:
        try:
            return settings.open(clock)
        except LinkClosed:
            raise
        except LinkError:
            if clock() > until_ns:
                raise
            time.sleep(1e-3)


_KINDS: dict[type, TypeAdapter[Any]] = {
    kind: TypeAdapter(kind) for kind in (ProcessSettings, Limits, Beat, Report, Event)
}
_COLUMNS = {"t_ns": "int64", "data": "", "quality": "uint8", "sequence": "int64", "device_ns": "int64"}
"""Of a block, and their types; that of `data` is the stream's."""


class GuardProcess:
    """A guard in a process of its own, as its rig sees it: the same methods as :class:`~.guard.LocalGuard`.

    Once it is lost, all that ask it raise GuardLostError. Samples, events and counts are those that have come.

    Parameters
    ----------
    settings
        Drivers, links and options of the axes and the force sensor, and where the log goes.

    Raises
    ------
    UsageError
        If this system is not POSIX.
    """

    force_stream: StreamSpec
    """The force sensor's stream, once it is started."""
    motor_stream: StreamSpec
    """The pressing axis' stream, likewise."""

    def __init__(self, settings: ProcessSettings) -> None:
        if os.name != "posix":
            raise UsageError("The guard's process needs sessions and signals of POSIX.", hint="Use Linux.")
        self._settings = settings
        self._clock = settings.clock()
        self._limits: Limits | None = None
        self._asked = ""
        self._closed = False
        self._lost: GuardLostError | None = None
        self._blocks: dict[str, list[Block]] = {"force": [], "motor": []}
        self._events: list[Event] = []
        self._counts: Mapping[str, Mapping[str, int]] = {}
        self._number = 0
        self._rest = b""
        self._socket, theirs = socket.socketpair()
        with theirs, Path(settings.log).open("ab") as errors:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, str(theirs.fileno())],
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=errors,
                stderr=errors,
            )

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Let the process open all devices."""
        found = self._ask("start", START_S, asdict(self._settings))
        self.force_stream, self.motor_stream = map(StreamSpec.model_validate, found["streams"])
        identity: Mapping[str, Mapping[str, str]] = found["identity"]
        return identity

    def arm(self, limits: Limits) -> Report:
        """Check, home, retract."""
        self._limits = limits
        try:
            return self._report("arm", ARM_S, limits)
        except GuardRefusesError:
            self._limits = None
            raise

    def beat(self, beat: Beat) -> Report:
        """Send a beat and wait for its report, some milliseconds."""
        return self._report("beat", self._patience_s, beat)

    def advance(self, until_ns: int) -> None:
        """Wait until the clock says so much, and take what comes meanwhile."""
        self._present()
        left_ns = 1
        while left_ns > 0:
            left_ns = until_ns - self._clock()
            self._receive(max(0.0, 1e-9 * left_ns))
            while self._said() is not None:
                pass

    def force_blocks(self) -> list[Block]:
        """Return all force samples since the last call."""
        return taken(self._blocks["force"])

    def motor_blocks(self) -> list[Block]:
        """Return all states of the pressing axis since the last call."""
        return taken(self._blocks["motor"])

    def events(self) -> list[Event]:
        """Return what has happened since the last call."""
        return taken(self._events)

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Return the counts."""
        return self._counts

    def disarm(self) -> Report:
        """Retreat if the pressing axis is not out, and expect no more beats."""
        report = self._report("disarm", ARM_S)
        self._limits = None
        return report

    def close(self) -> None:
        """Disarm and end the process; once closed, this does nothing."""
        if self._closed:
            return
        self._closed = True
        with suppress(OSError):
            self._socket.send(_line([0, "close", None]))
        try:
            self._process.wait(ARM_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        finally:
            self._socket.close()

    @property
    def _patience_s(self) -> float:
        return START_S if self._limits is None else self._limits.heartbeat_s

    def _present(self) -> None:
        if self._lost is not None:
            raise self._lost

    def _report(self, what: str, within_s: float, body: Limits | Beat | None = None) -> Report:
        report: Report = _read(Report, self._ask(what, within_s, body and asdict(body)))
        return report

    def _ask(self, what: str, within_s: float, body: Any = None) -> Any:
        """Send a request and return its answer; raises what the process says that it raised, or GuardLostError."""
        self._present()
        until_ns = self._clock() + round(1e9 * within_s)
        self._number, self._asked = self._number + 1, what
        with suppress(OSError):  # what reads fails then, too
            self._socket.sendall(_line([self._number, what, body]))
        while (said := self._said()) is None or said.get("number") != self._number:
            if said is None and not self._receive(max(0.0, 1e-9 * (until_ns - self._clock()))):
                self._fail(f"it has not answered within {within_s:.3f} s")
        if "error" in said:
            kind, message, hint = said["error"]
            found = getattr(errors, kind, GuardRefusesError)
            error: TactbenchError = found.__new__(found)  # some are made of other arguments
            TactbenchError.__init__(error, message, hint=hint)
            raise error
        return said["answer"]

    def _receive(self, timeout_s: float) -> bool:
        """Take what comes within a time; return whether anything did; raises GuardLostError if the process is gone."""
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return False
        data = b""
        with suppress(ConnectionError):
            data = self._socket.recv(1 << 20)
        if not data:
            self._fail("its socket is closed")
        self._rest += data
        return True

    def _said(self) -> Any:
        """Return the next line that has come, and keep what it brings; None: none has come whole."""
        line, end, rest = self._rest.partition(b"\n")
        if not end:
            return None
        self._rest = rest
        said = json.loads(line)
        for name, kept in self._blocks.items():
            kept += [_block(getattr(self, f"{name}_stream"), columns) for columns in said.get(name, ())]
        self._events += [_read(Event, event) for event in said.get("events", ())]
        self._counts = said.get("counts", self._counts)
        return said

    def _fail(self, why: str) -> NoReturn:
        """End the process and let the pressing axis retreat from here; raises GuardLostError, now and ever after."""
        with suppress(OSError):
            self._process.kill()
        outcome, trigger = "no axis was armed, nothing was sent", Trigger.GUARD_LOST
        try:
            if self._limits is not None:
                outcome = self._settings.rescue(self._clock, retreat=self._asked != "arm")
        except TactbenchError as error:
            trigger = Trigger.RETREAT_FAILED
            outcome = f"RETREAT FAILED: {error.message} Stand clear, and cut the axes' supply"
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        text = f"The guard's process is lost: {why}; {outcome}."
        self._events.append(Event(self._clock(), GuardState.FAULT, trigger, math.nan, math.nan, text))
        self._lost = GuardLostError(text, hint=f"Its last events are in {self._settings.log}.")
        raise self._lost


Guard: TypeAlias = LocalGuard | GuardProcess
"""What a rig drives its axes through: in its own process, or in one of its own."""


def _read(kind: type, said: Any) -> Any:
    return _KINDS[kind].validate_python(said)


def _line(said: Any) -> bytes:
    return json.dumps(said, default=float).encode() + b"\n"  # numpy's numbers, too


def _columns(block: Block) -> dict[str, Any]:
    return {name: column.tolist() for name in _COLUMNS if (column := getattr(block, name)) is not None}


def _block(stream: StreamSpec, columns: Mapping[str, Any]) -> Block:
    types = {**_COLUMNS, "data": stream.dtype}
    found: Any = {name: np.array(column, types[name]) for name, column in columns.items()}
    return Block(stream.name, **{"t_ns": None, **found})


class _Server:
    """The process' loop, around a guard."""

    def __init__(self, to_rig: socket.socket) -> None:
        self._socket = to_rig
        to_rig.setblocking(False)
        self._in = self._out = b""
        self._guard: LocalGuard | None = None
        self._clock: Clock = time.monotonic_ns
        self._parent = os.getppid()
        self._alone = self._over = False
        self.terminated = False

    def run(self) -> None:
        """Serve until the rig says `close` or is gone, or SIGTERM."""
        while not self._over:
            self._hear()
            self._flush()
            guard = self._guard
            if guard is not None:
                guard.look(LOOK_S)
                self._bring(guard)
            else:
                self._rest(IDLE_S)
            if self._left():
                if guard is None:
                    return
                if self.terminated:
                    guard.trip(Trigger.TERMINATED, "the guard's process was told to end")
                guard.trip(Trigger.RIG_LOST, "the rig's process has ended")
                if guard.state not in (GuardState.ARMED, GuardState.RETREATING):
                    return

    def close(self) -> None:
        """Close the devices."""
        if self._guard is not None:
            with suppress(TactbenchError):
                self._guard.close()
            _log({"left": self._clock()})

    def _left(self) -> bool:
        self._alone |= os.getppid() != self._parent
        return self._alone or self.terminated

    def _rest(self, seconds: float) -> None:
        select.select([] if self._alone else [self._socket], [], [], max(0.0, seconds))

    def _receive(self) -> None:
        with suppress(BlockingIOError):
            try:
                while data := self._socket.recv(1 << 16):
                    self._in += data
            except ConnectionError:
                pass
            self._alone = True

    def _interrupted(self) -> bool:
        """Return whether homing is to end: called between two answers of an axis."""
        self._receive()
        return self._left()

    def _hear(self) -> None:
        self._receive()
        *lines, self._in = self._in.split(b"\n")
        for line in lines:
            number, what, body = json.loads(line)
            said: dict[str, Any] = {"number": number}
            try:
                said["answer"] = self._answer(what, body)
            except TactbenchError as error:
                said["error"] = type(error).__name__, error.message, error.hint
            if self._guard is not None:
                self._bring(self._guard)  # before the answer that may rest on it
                said["counts"] = self._guard.counts()
            self._out += _line(said)

    def _bring(self, guard: LocalGuard) -> None:
        """Send samples and events that have come; what a rig does not take stays with the guard."""
        if len(self._out) > MOST_BYTES:
            return
        said = {
            "force": list(map(_columns, guard.force_blocks())),
            "motor": list(map(_columns, guard.motor_blocks())),
            "events": list(map(asdict, guard.events())),
        }
        if any(said.values()):
            self._out += _line(said)

    def _answer(self, what: str, body: Any) -> Any:
        if what == "close":
            self._over = True
            return None
        if what == "start":
            return self._start(_read(ProcessSettings, body))
        guard = self._guard
        if guard is None:
            raise GuardRefusesError("The guard was not started.", hint="Use start().")
        given = [] if body is None else [_read({"arm": Limits, "beat": Beat}[what], body)]
        return asdict(getattr(guard, what)(*given))

    def _start(self, settings: ProcessSettings) -> Any:
        self._clock = settings.clock()
        _log({"started": self._clock(), "unix_ns": time.time_ns(), "pid": os.getpid()})
        with ExitStack() as opened:
            guard = LocalGuard(
                {name: opened.enter_context(axis.open(self._clock)) for name, axis in settings.axes.items()},
                opened.enter_context(settings.force.open(self._clock)),
                self._clock,
                lambda until_ns: self._rest(1e-9 * (until_ns - self._clock())),
                on_event=lambda event: _log(asdict(event)),
                interrupted=self._interrupted,
                kept=Path(settings.log).with_suffix(".not-out"),
            )
            identity = guard.start()
            opened.pop_all()
        self._guard = guard
        # What there is by now stays: collections have little to look at.
        gc.freeze()
        streams = guard.force_stream, guard.motor_stream
        return {"identity": identity, "streams": [stream.model_dump(mode="json") for stream in streams]}

    def _flush(self) -> None:
        with suppress(OSError):  # full, or nobody there
            self._out = self._out[self._socket.send(self._out) :] if self._out else b""


def _log(entry: Mapping[str, Any]) -> None:
    with suppress(OSError):  # a full disk holds nobody up
        print(json.dumps(entry), flush=True)


def main() -> None:
    """Run the process: ``python -m … SOCKET``, the number of an open socket."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    server = _Server(socket.socket(fileno=int(sys.argv[1])))

    def terminate(_number: int, _frame: Any) -> None:
        server.terminated = True

    signal.signal(signal.SIGTERM, terminate)
    server.run()
    server.close()


if __name__ == "__main__":
    main()
