"""The guard in a process of its own: it alone has the links of axes and force sensor, and outlives its rig.

:class:`GuardProcess` is what the rig holds. The process is spawned in a session of its own, so that Ctrl-C at the
terminal does not reach it; SIGINT and SIGHUP are ignored, SIGTERM means: retreat, and leave. One thread takes messages
of the rig, then looks once, and so on. It waits for the rig nowhere; what the rig does not take is kept up to a bound,
then dropped and counted.

When the rig dies, the process retreats, writes so to its log and leaves. It notices by the end of the socket, by its
parent's number, or, whatever holds the socket open and whether the rig is dead or only hangs, by the age of the last
beat. When the process dies or does not answer a beat within heartbeat_s, the rig's side ends it, opens the axes' lines
and sends the same retreat, as long as the rig calls :meth:`GuardProcess.beat` or :meth:`GuardProcess.advance`. If both
die, axes end the move that is out, and hold.

Needs sessions, signals and packet sockets of Linux.
"""

from __future__ import annotations

import gc
import json
import math
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import time
import traceback
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import IO, Any, NoReturn, TypeAlias

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
from tactbench.links.link import Clock

START_S = 60.0
"""Within which the process is there and all devices have answered (assumed: imports of a busy machine)."""
ARM_S = 180.0
"""Within which the axes are homed and retracted."""
OPEN_S = 1.0
"""For so long a port is tried that another process still holds (assumed; free 5 ms after that was killed, measured)."""
MOST_BLOCKS = 50_000
"""Of samples kept for a rig that does not take them: some 50 s of a force sensor at 1 kHz."""
MOST_MESSAGES = 2000
"""Reports and events kept for it."""
ROWS = 1000
"""The most rows of a packet."""
PACKET = 1 << 18
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
        module, _, name = self.driver.partition(":")
        build = getattr(import_module(module), name)
        return build(DriverSettings(partial(open_link, self.link, clock), options=self.options, clock=clock))


@dataclass(frozen=True)
class ProcessSettings:
    """What a guard's process is given first."""

    axes: Mapping[str, DeviceSettings]
    """The pressing one first."""
    force: DeviceSettings
    log: str
    """A file to which events are added, one line of JSON each."""
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
                        said = f"{name} has retreated to {place:g} m"
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


class GuardProcess:
    """A guard in a process of its own, as its rig sees it: the same methods as :class:`~.guard.LocalGuard`.

    Once it is lost, all raise GuardLostError.

    Parameters
    ----------
    settings
        Drivers, links and options of the axes and the force sensor, and where the log goes.

    Raises
    ------
    UsageError
        If this system has no packet sockets.
    """

    def __init__(self, settings: ProcessSettings) -> None:
        if not hasattr(socket, "SOCK_SEQPACKET") or os.name != "posix":
            raise UsageError("The guard's process needs sessions, signals and sockets of POSIX.", hint="Use Linux.")
        self._settings = settings
        self._clock = settings.clock()
        self._limits: Limits | None = None
        self._arming = self._closed = False
        self._lost: GuardLostError | None = None
        self._streams: tuple[StreamSpec, StreamSpec] | None = None
        self._answer: tuple[type[TactbenchError] | None, Any] | None = None
        self._held: dict[str, list[Block]] = {"force": [], "motor": []}
        self._events: list[Event] = []
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs, Path(settings.log).open("ab") as errors:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, str(theirs.fileno())],
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=errors,
                stderr=errors,
            )
        self._socket.setblocking(False)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def force_stream(self) -> StreamSpec:
        """The force sensor's stream."""
        return self._started()[0]

    @property
    def motor_stream(self) -> StreamSpec:
        """The pressing axis' stream."""
        return self._started()[1]

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Let the process open all devices."""
        identity, self._streams = self._ask("start", START_S, self._settings, os.getpid())
        found: Mapping[str, Mapping[str, str]] = identity
        return found

    def arm(self, limits: Limits) -> Report:
        """Check, home, retract."""
        self._limits, self._arming = limits, True
        try:
            report: Report = self._ask("arm", ARM_S, limits)
        except GuardRefusesError:
            self._limits = None
            raise
        finally:
            self._arming = False
        return report

    def beat(self, beat: Beat) -> Report:
        """Send a beat and wait for its report, some milliseconds."""
        report: Report = self._ask("beat", ARM_S if self._limits is None else self._limits.heartbeat_s, beat)
        return report

    def advance(self, until_ns: int) -> None:
        """Wait until the clock says so much."""
        self._present()
        while (left_ns := until_ns - self._clock()) > 0:
            self._take(1e-9 * left_ns)

    def force_blocks(self) -> list[Block]:
        """Return all force samples since the last call."""
        return self._kept("force")

    def motor_blocks(self) -> list[Block]:
        """Return all states of the pressing axis since the last call."""
        return self._kept("motor")

    def events(self) -> list[Event]:
        """Return what has happened since the last call."""
        if self._lost is None and not self._closed:
            self._take(0.0)
        found, self._events = self._events, []
        return found

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Return the counts; of the guard also ``rows_dropped``: samples that this end did not take in time."""
        found: Mapping[str, Mapping[str, int]] = self._ask(
            "counts", START_S if self._limits is None else self._limits.heartbeat_s
        )
        return found

    def disarm(self) -> Report:
        """Retreat if the pressing axis is not out, and expect no more beats."""
        report: Report = self._ask("disarm", ARM_S)
        self._limits = None
        return report

    def close(self) -> None:
        """Disarm and end the process; once closed, this does nothing."""
        if self._closed:
            return
        self._closed = True
        with suppress(OSError):
            self._socket.send(pickle.dumps(("close", ())))
        try:
            # What it still sends is not waited for: it drops it.
            self._process.wait(ARM_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        finally:
            self._socket.close()

    def _started(self) -> tuple[StreamSpec, StreamSpec]:
        if self._streams is None:
            raise GuardRefusesError("The guard was not started.", hint="Use start().")
        return self._streams

    def _present(self) -> None:
        if self._lost is not None:
            raise self._lost
        if self._closed:
            raise GuardRefusesError("The guard is closed.", hint="Open a new one.")

    def _ask(self, kind: str, within_s: float, *body: Any) -> Any:
        """Send a message and return its answer; raises what the process says that it raised, or GuardLostError."""
        self._present()
        self._answer = None
        try:
            # A full socket means that nobody reads at the other end.
            self._socket.send(pickle.dumps((kind, body)))
        except OSError as error:
            self._fail(f"it does not take a message ({error})")
        until_ns = self._clock() + round(1e9 * within_s)
        while self._answer is None:
            left_s = 1e-9 * (until_ns - self._clock())
            self._take(max(0.0, left_s))
            if left_s <= 0.0 and self._answer is None:  # else this process was late itself
                self._fail(f"it has not answered within {within_s:.3f} s")
        error_kind, found = self._answer
        if error_kind is not None:
            message, hint = found
            raise error_kind(message, hint=hint)
        return found

    def _take(self, timeout_s: float) -> None:
        """Take what the process has sent, waiting for it at most so long; raises GuardLostError if it is gone."""
        select.select([self._socket], [], [], timeout_s)
        while True:
            data = b""
            try:
                data = self._socket.recv(PACKET)
            except BlockingIOError:
                return
            except ConnectionError:
                pass
            if not data:
                self._fail("its socket is closed")
            kind, body = pickle.loads(data)
            if kind in self._held:
                self._held[kind].append(body)
            elif kind == "event":
                self._events.append(body)
            else:
                self._answer = body

    def _kept(self, kind: str) -> list[Block]:
        if self._lost is None and not self._closed:
            self._take(0.0)
        found, self._held[kind] = self._held[kind], []
        return found

    def _fail(self, why: str) -> NoReturn:
        """End the process and let the pressing axis retreat from here; raises GuardLostError, now and ever after."""
        with suppress(OSError):
            self._process.kill()
        outcome, trigger = "no axis was armed, nothing was sent", Trigger.GUARD_LOST
        try:
            if self._limits is not None:
                outcome = self._settings.rescue(self._clock, retreat=not self._arming)
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


class _Server:
    """The process' loop, around a guard."""

    def __init__(self, to_rig: socket.socket) -> None:
        self._socket = to_rig
        to_rig.setblocking(False)
        self._messages: deque[bytes] = deque(maxlen=MOST_MESSAGES)
        self._blocks: deque[bytes] = deque()
        self._guard: LocalGuard | None = None
        self._settings: ProcessSettings | None = None
        self._clock: Clock = time.monotonic_ns
        self._log: IO[str] | None = None
        self._parent: int | None = None
        self._alone = self._over = self._said_why = self._arming = False
        self._dropped_rows = 0
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
                self._rest(IDLE_S)
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
        """After an error within the guard: write it down; armed, the pressing axis retreats, else all stand."""
        self._write({"internal_error": traceback.format_exc()})
        guard, settings = self._guard, self._settings
        armed = guard is not None and guard.state in (GuardState.ARMED, GuardState.RETREATING)
        if guard is None or settings is None or not (armed or self._arming):
            return
        guard.abandon()
        with suppress(TactbenchError):
            self._write({"rescued": settings.rescue(self._clock, retreat=armed and not self._arming)})

    def _left(self) -> bool:
        """Return whether the process is to end."""
        if self._parent is not None and os.getppid() != self._parent:
            self._alone = True
        return self._alone or self.terminated

    def _tell_why(self, guard: LocalGuard) -> None:
        if self._said_why:
            return
        self._said_why = True
        if self.terminated:
            guard.trip(Trigger.TERMINATED, "the guard's process was told to end")
        else:
            guard.trip(Trigger.RIG_LOST, "the rig's process has ended")
        self._write({"leaving": self._clock(), "terminated": self.terminated, "rig_lost": self._alone})

    def _rest(self, seconds: float) -> None:
        select.select([] if self._alone else [self._socket], [], [], max(0.0, seconds))

    def _interrupted(self) -> bool:
        """Return whether homing is to end: called between two answers of an axis."""
        with suppress(BlockingIOError):
            try:
                self._alone |= self._socket.recv(1, socket.MSG_PEEK) == b""
            except ConnectionError:
                self._alone = True
        return self._left()

    def _hear(self) -> None:
        while not self._alone:
            try:
                data = self._socket.recv(PACKET)
            except BlockingIOError:
                return
            except ConnectionError:
                data = b""
            if not data:
                self._alone = True
                return
            self._carry_out(*pickle.loads(data))

    def _carry_out(self, kind: str, body: tuple[Any, ...]) -> None:
        if kind == "close":
            self._over = True
            return
        self._arming = kind == "arm"
        if self._arming:
            self._dropped_rows = 0  # of the time between two scenes
        try:
            if kind == "start":
                found: Any = self._start(*body)
            elif self._guard is None:
                raise GuardRefusesError("The guard was not started.", hint="Use start().")
            else:
                found = getattr(self._guard, kind)(*body)
            if kind == "counts":
                found["guard"]["rows_dropped"] = self._dropped_rows
        except TactbenchError as error:
            self._say("answer", (type(error), (error.message, error.hint)))
        else:
            self._say("answer", (None, found))
        self._arming = False

    def _start(self, settings: ProcessSettings, parent: int) -> Any:
        self._parent, self._settings, self._clock = parent, settings, settings.clock()
        self._log = Path(settings.log).open("a", encoding="utf-8", buffering=1)  # noqa: SIM115  (closed in `close`)
        self._write({"started": self._clock(), "unix_ns": time.time_ns(), "pid": os.getpid()})
        opened: dict[str, Any] = {}
        try:
            for name, device in {**settings.axes, "force": settings.force}.items():
                opened[name] = device.open(self._clock)
            force = opened["force"]
            guard = LocalGuard(
                {name: opened[name] for name in settings.axes},
                force,
                self._clock,
                lambda until_ns: self._rest(1e-9 * (until_ns - self._clock())),
                on_event=self._event,
                interrupted=self._interrupted,
            )
            identity = guard.start()
        except TactbenchError:
            for driver in opened.values():
                driver.close()
            raise
        self._guard = guard
        # What there is by now stays: collections have little to look at.
        gc.collect()
        gc.freeze()
        return identity, (guard.force_stream, guard.motor_stream)

    def _event(self, event: Event) -> None:
        self._say("event", event)
        self._write(asdict(event))

    def _say(self, kind: str, body: Any) -> None:
        self._messages.append(pickle.dumps((kind, body)))
        self._flush()

    def _forward(self, guard: LocalGuard) -> None:
        guard.events()
        blocks = [("force", block) for block in guard.force_blocks()]
        blocks += [("motor", block) for block in guard.motor_blocks()]
        # In pieces that fit into a packet.
        for kind, block in blocks:
            for first in range(0, len(block.data), ROWS):
                piece = block.rows(slice(first, first + ROWS))
                if len(self._blocks) < MOST_BLOCKS:
                    self._blocks.append(pickle.dumps((kind, piece)))
                else:
                    self._dropped_rows += len(piece.data)

    def _flush(self) -> None:
        with suppress(OSError):  # full, or nobody there
            for waiting in (self._messages, self._blocks):
                while waiting and not self._alone:
                    self._socket.send(waiting[0])
                    waiting.popleft()

    def _write(self, entry: Mapping[str, Any]) -> None:
        if self._log is not None:
            with suppress(OSError):
                self._log.write(json.dumps(entry) + "\n")


def main() -> int:
    """Run the process: ``python -m … SOCKET``, the number of an open socket."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    server = _Server(socket.socket(fileno=int(sys.argv[1])))

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
    # Pickled classes are those of the module, not of __main__.
    from tactbench.devices.guard_process import main as run

    sys.exit(run())
