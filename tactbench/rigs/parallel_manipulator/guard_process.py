"""The guard in a process of its own: it alone has the links of motor and force sensor, and outlives its rig.

:class:`GuardProcess` is what the rig holds. The process is spawned, in a session of its own, so that Ctrl-C at the
terminal does not reach it; SIGINT and SIGHUP are ignored, SIGTERM means: retreat, and leave. Beats and reports are
lines of JSON on a socket; samples go back on a second one. The process never waits for the rig: what the rig does not
take is kept up to a bound, then dropped and counted.

When the rig dies, the process retreats, writes so to its log and leaves. It notices by the end of the socket, by its
parent's number, or, whatever holds the socket open and whether the rig is dead or only hangs, by the age of the last
beat: retreat within heartbeat_s + t_r (:func:`.guard.reaction`).

When the process dies or does not answer a beat within heartbeat_s, the rig's side ends it, opens the motor's line and
sends the same retreat: within two heartbeat_s, as long as the rig calls :meth:`GuardProcess.beat` or
:meth:`GuardProcess.advance`. If both die, the motor ends the one increment that is out, and holds (assumed of the
drive).

Needs a system with sessions and signals of POSIX.
"""

from __future__ import annotations

import gc
import json
import math
import os
import selectors
import signal
import socket
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO, Any, NoReturn

from tactbench.plugin import Block, RigError, StreamSpec, TactbenchError, UsageError, load_object
from tactbench.plugin.devices import Clock, DriverSettings, LinkError, LinkTimeout, LinkUnplugged, open_link
from tactbench.rigs.parallel_manipulator.guard import LOOK_S, LocalGuard
from tactbench.rigs.parallel_manipulator.guard_interface import (
    Beat,
    Event,
    GuardLostError,
    GuardRefusesError,
    GuardState,
    Limits,
    Report,
    Trigger,
)
from tactbench.rigs.parallel_manipulator.guard_messages import (
    FORCE,
    MOTOR,
    BlockReader,
    MessageReader,
    ProcessSettings,
    encode_block,
    encode_message,
)
from tactbench.rigs.parallel_manipulator.motor.commands import HOMING_S
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.retreat import retreat_blind, stand_blind
from tactbench.rigs.parallel_manipulator.options import read_options

START_S = 60.0
"""Within which the process is there and both devices have answered (assumed: imports of a busy machine)."""
MOST_BYTES = 4 << 20
"""Of samples kept for a rig that does not take them: some 50 s of a force sensor at 1 kHz (derived: 78 bytes a row)."""
MOST_REPORTS = 1 << 18
"""Bytes of reports and events kept for it."""
AGE_STEP_S = 0.05
"""Wait for the rig's first words, and its last."""

_KINDS: dict[str, type[TactbenchError]] = {
    kind.__name__: kind for kind in (GuardRefusesError, LinkError, LinkTimeout, LinkUnplugged, RigError, UsageError)
}


def _clock_from(zero_ns: int) -> Clock:
    return lambda: time.monotonic_ns() - zero_ns


class GuardProcess:
    """A guard in a process of its own, as its rig sees it; a :class:`Guard`.

    Parameters
    ----------
    settings
        Drivers, links and options of motor and force sensor, and where the log goes.

    Raises
    ------
    UsageError
        If this system has no sessions, or the motor's options are wrong.
    """

    def __init__(self, settings: ProcessSettings) -> None:
        if os.name != "posix":
            raise UsageError("The guard's process needs sessions and signals of POSIX.", hint="Use Linux.")
        self._settings = settings
        self._options = read_options(FaulhaberOptions, settings.motor.options, "faulhaber")
        self._clock = _clock_from(settings.clock_zero_ns)
        self._limits: Limits | None = None
        self._arming = False
        self._lost: GuardLostError | None = None
        self._streams: tuple[StreamSpec, StreamSpec] | None = None
        self._reader = MessageReader()
        self._blocks: BlockReader | None = None
        self._waiting: list[tuple[str, dict[str, Any]]] = []
        self._held: dict[int, list[Block]] = {FORCE: [], MOTOR: []}
        self._events: list[Event] = []
        self._closed = False
        self._control, theirs = socket.socketpair()
        self._data, theirs_data = socket.socketpair()
        with theirs, theirs_data, Path(settings.log).open("ab") as errors:
            descriptors = (theirs.fileno(), theirs_data.fileno())
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, *map(str, descriptors)],
                pass_fds=descriptors,
                start_new_session=True,
                stdin=subprocess.DEVNULL,
                stdout=errors,
                stderr=errors,
            )
        self._selector = selectors.DefaultSelector()
        for end in (self._control, self._data):
            end.setblocking(False)
            self._selector.register(end, selectors.EVENT_READ)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def force_stream(self) -> StreamSpec:
        """The force sensor's stream."""
        return self._started()[FORCE]

    @property
    def motor_stream(self) -> StreamSpec:
        """The motor's stream."""
        return self._started()[MOTOR]

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Let the process open both devices; see :meth:`Guard.start`."""
        self._say("start", {**self._settings.body(), "parent": os.getpid()})
        _, body = self._answer("started", START_S)
        force, motor = (StreamSpec.model_validate_json(text) for text in body["streams"])
        self._streams = force, motor
        self._blocks = BlockReader((force.name, motor.name))
        identity: Mapping[str, Mapping[str, str]] = body["identity"]
        return identity

    def arm(self, limits: Limits) -> Report:
        """See :meth:`Guard.arm`."""
        self._limits, self._arming = limits, True
        self._say("arm", json.loads(limits.to_json()))
        try:
            report = self._report(0, HOMING_S + 2 * limits.retreat_s + START_S)
        except GuardRefusesError:
            self._limits = None
            raise
        finally:
            self._arming = False
        return report

    def beat(self, beat: Beat) -> Report:
        """See :meth:`Guard.beat`; waits for the report, some milliseconds."""
        self._say("beat", json.loads(beat.to_json()))
        return self._report(beat.sequence, math.inf if self._limits is None else self._limits.heartbeat_s)

    def advance(self, until_ns: int) -> None:
        """Wait; see :meth:`Guard.advance`."""
        self._present()
        while (left_ns := until_ns - self._clock()) > 0:
            self._take(1e-9 * left_ns)

    def force_blocks(self) -> list[Block]:
        """See :meth:`Guard.force_blocks`."""
        return self._kept(FORCE)

    def motor_blocks(self) -> list[Block]:
        """See :meth:`Guard.motor_blocks`."""
        return self._kept(MOTOR)

    def events(self) -> list[Event]:
        """See :meth:`Guard.events`."""
        if self._lost is None and not self._closed:
            self._take(0.0)
        found, self._events = self._events, []
        return found

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """See :meth:`Guard.counts`; of the guard also ``rows_dropped``: samples that this end did not take in time."""
        self._say("counts")
        _, body = self._answer("counts", START_S if self._limits is None else self._limits.heartbeat_s)
        return body

    def disarm(self) -> Report:
        """See :meth:`Guard.disarm`."""
        way_s = 0.0 if self._limits is None else self._limits.retreat_s
        self._say("disarm")
        report = self._report(0, way_s + START_S)
        self._limits = None
        return report

    def close(self) -> None:
        """Disarm and end the process; see :meth:`Guard.close`."""
        if self._closed:
            return
        self._closed = True
        way_s = 0.0 if self._limits is None else self._limits.retreat_s
        with suppress(OSError):
            self._control.sendall(encode_message("close"))
        try:
            # What it still sends is not waited for: it drops it.
            self._process.wait(way_s + START_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        finally:
            self._selector.close()
            self._control.close()
            self._data.close()

    # ------------------------------------------------------------------------------------------------------------------

    def _started(self) -> tuple[StreamSpec, StreamSpec]:
        if self._streams is None:
            raise GuardRefusesError("The guard was not started.", hint="Use start().")
        return self._streams

    def _present(self) -> None:
        if self._lost is not None:
            raise self._lost
        if self._closed:
            raise GuardRefusesError("The guard is closed.", hint="Open a new one.")

    def _say(self, kind: str, body: dict[str, Any] | None = None) -> None:
        self._present()
        try:
            # A line of some hundred bytes; a full socket means that nobody reads at the other end.
            self._control.sendall(encode_message(kind, body))
        except OSError as error:
            self._gone(f"it does not take a message ({error})")

    def _report(self, sequence: int, within_s: float) -> Report:
        until_ns = self._clock() + round(1e9 * min(within_s, START_S + HOMING_S))
        while True:
            _, body = self._answer("report", max(0.0, 1e-9 * (until_ns - self._clock())))
            report = Report(**body)
            if report.sequence == sequence:
                return report

    def _answer(self, kind: str, within_s: float) -> tuple[str, dict[str, Any]]:
        """Return the next message of a kind; raises what the process says that it raised, or GuardLostError."""
        until_ns = self._clock() + round(1e9 * within_s)
        while True:
            for number, (one, body) in enumerate(self._waiting):
                if one in (kind, "error"):
                    del self._waiting[number]
                    if one == "error":
                        raise _KINDS.get(body["kind"], RigError)(body["message"], hint=body["hint"])
                    return one, body
            left_s = 1e-9 * (until_ns - self._clock())
            if left_s <= 0.0:
                self._gone(f"it has not answered within {within_s:.3f} s")
            self._take(left_s)

    def _take(self, timeout_s: float) -> None:
        """Take what the process has sent, waiting for it at most so long; raises GuardLostError if it is gone."""
        for key, _ in self._selector.select(timeout_s):
            data = b""
            try:
                data = key.fileobj.recv(1 << 18)  # type: ignore[union-attr]
            except BlockingIOError:
                continue
            except ConnectionError:
                pass
            if not data:
                self._gone("its socket is closed")
            if key.fileobj is self._data:
                if self._blocks is not None:
                    for device, block in self._blocks.feed(data):
                        self._held[device].append(block)
                continue
            for kind, body in self._reader.feed(data):
                if kind == "event":
                    self._events.append(Event(**body))
                else:
                    self._waiting.append((kind, body))

    def _kept(self, device: int) -> list[Block]:
        if self._lost is None and not self._closed:
            self._take(0.0)
        found, self._held[device] = self._held[device], []
        return found

    def _gone(self, why: str) -> NoReturn:
        """End the process and let the motor retreat from here; raises GuardLostError, now and ever after."""
        with suppress(OSError):
            self._process.kill()
        said = "the motor was not armed, nothing was sent to it"
        opener = partial(open_link, self._settings.motor.link, self._clock)
        trigger, position_m = Trigger.GUARD_LOST, math.nan
        try:
            if self._arming:
                stand_blind(opener, self._options, self._clock)
                said = "the motor was told to stand"
            elif self._limits is not None:
                position_m = retreat_blind(opener, self._options, self._clock, self._limits.retreat_s)
                said = f"the motor has retreated to {position_m:g} m"
        except TactbenchError as error:
            trigger = Trigger.RETREAT_FAILED
            said = f"RETREAT FAILED: {error.message} Stand clear, and cut the motor's supply"
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        text = f"The guard's process is lost: {why}; {said}."
        self._events.append(Event(self._clock(), GuardState.FAULT, trigger, math.nan, position_m, text))
        self._lost = GuardLostError(text, hint=f"Its last events are in {self._settings.log}.")
        raise self._lost


# The process ----------------------------------------------------------------------------------------------------------


class _Server:
    """The process's loop, around a guard."""

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
        self._told_alone = self._arming = False
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
        if self._told_alone:
            return
        self._told_alone = True
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
        self._clock = _clock_from(settings.clock_zero_ns)
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
