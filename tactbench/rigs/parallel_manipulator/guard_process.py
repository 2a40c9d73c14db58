"""The guard in a process of its own: it alone has the links of motor and force sensor, and outlives its rig.

:class:`GuardProcess` is what the rig holds; the process itself is :mod:`~.guard_server`. It is spawned in a session of
its own, so that Ctrl-C at the terminal does not reach it. Beats and reports are lines of JSON on a socket; samples go
back on a second one.

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

import json
import math
import os
import selectors
import socket
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from tactbench.plugin import Block, RigError, StreamSpec, TactbenchError, UsageError
from tactbench.plugin.devices import LinkError, LinkTimeout, LinkUnplugged, open_link
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
    encode_message,
)
from tactbench.rigs.parallel_manipulator.motor.commands import HOMING_S
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.retreat import retreat_blind, stand_blind
from tactbench.rigs.parallel_manipulator.options import read_options

START_S = 60.0
"""Within which the process is there and both devices have answered (assumed: imports of a busy machine)."""
SERVER = "tactbench.rigs.parallel_manipulator.guard_server"

_KINDS: dict[str, type[TactbenchError]] = {
    kind.__name__: kind for kind in (GuardRefusesError, LinkError, LinkTimeout, LinkUnplugged, RigError, UsageError)
}


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
        self._clock = settings.clock()
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
        self._control, child_control = socket.socketpair()
        self._data, child_data = socket.socketpair()
        with child_control, child_data, Path(settings.log).open("ab") as errors:
            descriptors = (child_control.fileno(), child_data.fileno())
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", SERVER, *map(str, descriptors)],
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
            self._fail(f"it does not take a message ({error})")

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
                self._fail(f"it has not answered within {within_s:.3f} s")
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
                self._fail("its socket is closed")
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

    def _fail(self, why: str) -> NoReturn:
        """End the process and let the motor retreat from here; raises GuardLostError, now and ever after."""
        with suppress(OSError):
            self._process.kill()
        outcome = "the motor was not armed, nothing was sent to it"
        opener = partial(open_link, self._settings.motor.link, self._clock)
        trigger, position_m = Trigger.GUARD_LOST, math.nan
        try:
            if self._arming:
                stand_blind(opener, self._options, self._clock)
                outcome = "the motor was told to stand"
            elif self._limits is not None:
                position_m = retreat_blind(opener, self._options, self._clock, self._limits.retreat_s)
                outcome = f"the motor has retreated to {position_m:g} m"
        except TactbenchError as error:
            trigger = Trigger.RETREAT_FAILED
            outcome = f"RETREAT FAILED: {error.message} Stand clear, and cut the motor's supply"
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        text = f"The guard's process is lost: {why}; {outcome}."
        self._events.append(Event(self._clock(), GuardState.FAULT, trigger, math.nan, position_m, text))
        self._lost = GuardLostError(text, hint=f"Its last events are in {self._settings.log}.")
        raise self._lost
