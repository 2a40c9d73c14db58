"""One child process as its parent sees it: started, given items, watched, ended."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from typing import Any

from tactbench.core.errors import CellStopped
from tactbench.core.pool import endings, memory
from tactbench.core.pool.child import WHERE_SIGNAL, run_child
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.log import cut_back, flush, open_log, tail
from tactbench.core.pool.message import Inbox, load_error
from tactbench.core.pool.processes import kill_tree

STACK_S = 0.1
"""Seconds that a process which is about to be ended has to write where it is."""
CLOSED_S = 2.0
"""Seconds that a process may still be there once its pipe is closed: one that dies closes it first, and a busy machine
reports its end some tenths of a second later."""
START_S = 60.0
"""Seconds that a process may take to begin with its item: a fork server imports libraries first."""


PRELOAD = ("tactbench.core.matrix.preloaded",)
"""What the fork server of a process imports, once: there is one for all pools, which keeps what it began with."""

PENDING = object()
"""Says that there is no outcome yet."""


class Worker:
    """A child process that carries out items, one at a time.

    Parameters
    ----------
    work
        What it does with an item.
    items
        What it may be given, by index. With `work` it is inherited where this process forks, and else pickled.
    limits
        What one item may take.
    fork
        Whether this process forks; else a fork server does.

    Raises
    ------
    Exception
        If a fork server is used, and `work` or `items` cannot be pickled.
    """

    def __init__(self, work: Callable[[Any], Any], items: Sequence[Any], limits: Limits, fork: bool) -> None:
        self.items = items
        self.index = 0
        """Of the item that it is busy with."""
        self.begun = False
        """Whether it has begun with that."""
        self._limits = limits
        self._stopped: CellStopped | None = None
        """Why it was told to end."""
        context: Any = multiprocessing.get_context("fork" if fork else "forkserver")
        if not fork:
            context.set_forkserver_preload(list(PRELOAD))
        log = Connection(open_log())
        self._log: Connection[Any, Any] = log
        self.connection, child_end = multiprocessing.Pipe()
        flush()
        try:
            parent = os.getpid() if fork else None
            self._process = context.Process(target=run_child, args=(work, items, child_end, log, limits, parent))
            self._process.start()
            self.pid: int = self._process.pid
        except BaseException:
            self.connection.close()
            log.close()
            raise
        finally:
            child_end.close()
        os.set_blocking(self.connection.fileno(), False)
        self._inbox = Inbox(self.connection.fileno())
        self._shared_mb = memory.resident_mb(os.getpid()) if fork and limits.memory_mb else 0.0
        """What it holds without having taken it."""
        self._kills = memory.oom_kills()

    @property
    def waits_on(self) -> tuple[Any, ...]:
        """What becomes readable when there is something to look at."""
        return (self._process.sentinel,) if self._closed_s else (self.connection, self._process.sentinel)

    def begin(self, index: int, second: bool) -> None:
        """Have it carry out an item; `second`: another process has ended before it had begun with that."""
        self.index, self.second, self.begun = index, second, False
        self._began_s = time.monotonic()
        self._closed_s: float | None = None
        """When the pipe of its result was found closed."""
        self._ends_s: float | None = self._began_s + START_S
        if self._limits.memory_mb:
            self._shared_mb = max(self._shared_mb, memory.resident_mb(self.pid))
        with suppress(OSError):  # it has ended: `outcome` says so
            self.connection.send_bytes(str(index).encode())

    def wait_s(self) -> float:
        """Return the seconds until it must be looked at again, at most."""
        tick = 0.1 if self._limits.memory_mb is None else 0.02
        return tick if self._ends_s is None else max(0.0, min(tick, self._ends_s - time.monotonic()))

    def outcome(self) -> Any:
        """Return what came of its item: a result, an error, or `PENDING`."""
        over = self._process.exitcode is not None  # before the pipe is read: what it sent last is not missed
        open_ = self._inbox.read()
        try:
            message = self._inbox.message()
            if message is not None and "begun" in message:
                self.begun = True
                self._began_s = time.monotonic()
                self._ends_s = None if self._limits.timeout_s is None else self._began_s + self._limits.timeout_s
                message = self._inbox.message()
            if message is not None:
                return self._result(message)
        except (ValueError, KeyError, TypeError) as error:
            return self._stop(endings.garbled(error))
        if over:
            return self._ended()
        if not open_:
            self._closed_s = self._closed_s or time.monotonic()
            if time.monotonic() - self._closed_s > CLOSED_S:
                return self._stop(endings.silenced())
        return self._limited()

    def _result(self, message: dict[str, Any]) -> Any:
        if self._stopped is not None:
            return self._stop(self._stopped)
        if self._limits.timeout_s is not None and float(message["spent_s"]) > self._limits.timeout_s:
            return self._stop(endings.too_slow(self._limits))
        if "error" not in message:
            return message["value"]
        error = load_error(message["error"], self._printed())
        if isinstance(error, CellStopped):
            error.spent_s = time.monotonic() - self._began_s
        return error

    def _stop(self, why: CellStopped) -> CellStopped:
        """End the process; return why."""
        self._stopped = self._stopped or why
        self._kill()
        return self._ended()

    def _ended(self) -> CellStopped:
        """Return why the process has ended without a result."""
        self._process.join()
        if self._stopped is None:
            short = memory.oom_kills() > self._kills
            self._stopped = endings.crashed(self._process.exitcode, self._printed(), memory_was_short=short)
        self._stopped.log = self._printed()
        self._stopped.spent_s = time.monotonic() - self._began_s
        return self._stopped

    def _limited(self) -> Any:
        """End the process if its item has taken more than it may."""
        cut_back(self._log.fileno())
        now_s = time.monotonic()
        if self._ends_s is not None and now_s >= self._ends_s:
            if self._stopped is not None:  # it was asked to end, and the time for that is up as well
                return self._stop(self._stopped)
            late = endings.too_slow(self._limits) if self.begun else endings.never_began(START_S)
            late.traceback_text = self._where()
            if not self._limits.grace_s:
                return self._stop(late)
            self._stopped = late
            self._ask_to_end()
        elif (
            self._limits.memory_mb is not None and self._stopped is None and self.begun
            and memory.taken_mb(self.pid, self._shared_mb) > self._limits.memory_mb
        ):  # fmt: skip
            return self._stop(endings.out_of_memory(self._limits))
        return PENDING

    def _ask_to_end(self) -> None:
        self._ends_s = time.monotonic() + self._limits.grace_s
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGTERM)

    def _where(self) -> str:
        """Have the process write its stacks to the log, and return them; "" if it does not."""
        if WHERE_SIGNAL is None:
            return ""
        before = len(self._printed())
        with suppress(ProcessLookupError):
            os.kill(self.pid, WHERE_SIGNAL)
        until = time.monotonic() + STACK_S
        length = -1
        while time.monotonic() < until and not (length == len(self._printed()) > before):
            length = len(self._printed())
            wait([self._process.sentinel], STACK_S / 20)
        printed = self._printed()[before:]
        return printed if "most recent call first" in printed else ""

    def _printed(self) -> str:
        return tail(self._log.fileno())

    @property
    def alive(self) -> bool:
        """Whether it can be given another item."""
        return self._process.exitcode is None

    def give_grace(self) -> None:
        """Ask it to end, and leave it the time that it has for that."""
        if self._limits.grace_s and self.alive:
            self._ask_to_end()
            self._process.join(self._limits.grace_s)

    def _kill(self) -> None:
        """Kill it, and whatever it has started."""
        if self.alive:
            kill_tree(self.pid)

    def close(self) -> None:
        """Kill it, wait for its end, and let go of it."""
        self._kill()
        self._process.join()
        self._process.close()
        self.connection.close()
        self._log.close()
