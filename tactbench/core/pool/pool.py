"""The parent's side of the process pool."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, TypeVar

import psutil

from tactbench.core.errors import CellStopped, Crashed, TimedOut
from tactbench.core.pool.child import end_of, out_of_memory, plain_error, run_child
from tactbench.core.pool.limits import UNLIMITED, Limits, resident_mb

T = TypeVar("T")
R = TypeVar("R")

START_S = 60.0
"""Seconds within which a process must begin with its first item; with `spawn` it imports libraries first."""
POLL_S = 0.05
"""Seconds between two looks at the memory and time of children."""
KILL_DELAY_S = 0.2
"""Seconds beyond its time limit after which an item is ended: it writes its stacks at the limit."""
MOST_LOG_BYTES = 2**24
"""A log that grows beyond this is emptied."""


class Pool:
    """Up to `jobs` child processes, each for one piece of work.

    A piece is a sequence of items that one process carries out in order. An item that raises, crashes, hangs or takes
    too much memory has that error as its outcome; the items after it get a process of their own.

    Parameters
    ----------
    jobs
        Pieces carried out at the same time.
    limits
        What one item may take.

    Notes
    -----
    Processes come from the fork server of `multiprocessing`, or are spawned where there is none or `spawn` is the start
    method. Work, items and results are pickled; results must be of types of the standard library, numpy or tactbench.
    """

    def __init__(self, jobs: int = 1, limits: Limits = UNLIMITED) -> None:
        self.jobs, self.limits = jobs, limits
        self._waiting: deque[tuple[Callable[[Any], Any], Sequence[Any]]] = deque()
        self._busy: list[_Worker] = []

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        """End every process that is at work."""
        for worker in self._busy:
            worker.terminate()
        for worker in self._busy:
            worker.end()
        self._busy.clear()
        self._waiting.clear()

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> None:
        """Queue a piece of work; may be called while `outcomes` is iterated."""
        if items:
            self._waiting.append((work, items))

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Yield every submitted item with its result or the error that stopped it, in the order in which they end."""
        while self._waiting or self._busy:
            while self._waiting and len(self._busy) < self.jobs:
                work, items = self._waiting.popleft()
                try:
                    self._busy.append(_Worker(work, items, self.limits))
                except Exception as error:  # it cannot be pickled, or the system starts no more processes
                    for item in items:
                        yield item, plain_error(error)
            wait([source for worker in self._busy for source in worker.waits_on], POLL_S)
            for worker in list(self._busy):
                yield from worker.poll()
                if worker.over:
                    worker.end()
                    self._busy.remove(worker)
                    if left := worker.items[worker.index :]:
                        self._waiting.appendleft((worker.work, left))

    def each(
        self, work: Callable[[T], R], items: Iterable[T], *, together: bool = False
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Carry out `work` for every item, each in its own process or all `together` in one, and yield outcomes."""
        with self:
            every = list(items)
            for piece in [every] if together else [[item] for item in every]:
                self.submit(work, piece)
            yield from self.outcomes()


class InProcess:
    """Carries out items in this process, without limits: for a debugger. Ctrl-C ends it."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Callable[[Any], Any], Any]] = deque()

    def __enter__(self) -> InProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self._waiting.clear()

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> None:
        """Queue items."""
        self._waiting.extend((work, item) for item in items)

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Yield every item with its result or the error that stopped it."""
        while self._waiting:
            work, item = self._waiting.popleft()
            try:
                outcome = work(item)
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                outcome = plain_error(error)
            yield item, outcome

    def each(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[tuple[T, R | BaseException]]:
        """Carry out `work` for every item and yield outcomes."""
        self.submit(work, list(items))
        yield from self.outcomes()


class _Worker:
    """A child process with its piece of work."""

    def __init__(self, work: Callable[[Any], Any], items: Sequence[Any], limits: Limits) -> None:
        self.work, self.items, self.index, self.over = work, items, 0, False
        self._limits = limits
        context = _context()
        self._connection, theirs = context.Pipe()
        handle, log = tempfile.mkstemp(prefix="tactbench-", suffix=".log")
        os.close(handle)
        self._log: str | None = log
        self._printed = ""
        arguments = (work, items, theirs, log, str(Path.cwd()), limits)
        try:
            self._process = context.Process(target=run_child, args=arguments)
            with _without_main():
                self._process.start()
        except BaseException:
            self._connection.close()
            Path(log).unlink(missing_ok=True)
            raise
        finally:
            theirs.close()
        self._began_s, self._begun, self._shared_mb = time.monotonic(), False, 0.0

    @property
    def waits_on(self) -> tuple[Any, ...]:
        return self._connection, self._process.sentinel

    def poll(self) -> Iterator[tuple[Any, Any]]:
        """Yield what has come of items; set `over` once the process is of no more use."""
        ended = not self._process.is_alive()  # before the pipe is read: what it sent last is not missed
        while not self.over:
            try:
                if not self._connection.poll():
                    break
                kind, value = self._connection.recv()
            except (EOFError, OSError):  # it has ended, or closed what is not its own
                self._process.join(START_S if ended else 1.0)
                ended = True
                break
            if kind == "begun":
                self._began_s, self._begun, self._shared_mb = time.monotonic(), True, value
                continue
            yield self._next(), value
            self.over = self.index == len(self.items)
        if self.over:
            return
        stopped = self._crashed() if ended else self._beyond_limits()
        if stopped is not None:
            stopped.spent_s = time.monotonic() - self._began_s
            self.over = True
            self.end()
            stopped.log = self.log()
            yield self._next(), stopped

    def _next(self) -> Any:
        item = self.items[self.index]
        self.index += 1
        self._begun = False
        self._began_s = time.monotonic()
        return item

    def _beyond_limits(self) -> CellStopped | None:
        """Return why the item at work must be ended; None if it need not."""
        if self._log and Path(self._log).stat().st_size > MOST_LOG_BYTES:
            os.truncate(self._log, 0)
        spent_s = time.monotonic() - self._began_s
        if not self._begun:
            late = Crashed(f"Its process did not begin within {START_S:g} s.", hint="Run fewer at once (--jobs).")
            return late if spent_s > START_S else None
        timeout_s, memory_mb = self._limits.timeout_s, self._limits.memory_mb
        if timeout_s is not None and spent_s > timeout_s + KILL_DELAY_S:
            text = f"It was stopped: it took longer than {timeout_s:g} s."
            return TimedOut(text, hint="Allow more with --timeout SECONDS.", traceback_text=_stacks(self.log()))
        if memory_mb is not None and resident_mb(self._process.pid) - self._shared_mb > memory_mb:
            return out_of_memory(self._limits)
        return None

    def _crashed(self) -> Crashed:
        code = self._process.exitcode or 0
        if code >= 0:
            return Crashed(f"Its process ended with exit code {code} and gave no result.",
                           hint="Something in it calls os._exit or closes what is not its own.")  # fmt: skip
        name = next((one.name for one in signal.Signals if one == -code), "unknown")
        hint = "What it printed last may say where."
        if name == "SIGKILL":
            hint = "If memory was short, run fewer at once (--jobs) or limit each (--memory MB)."
        return Crashed(f"Its process was ended by signal {-code} ({name}).", hint=hint, signal=-code,
                       traceback_text=_stacks(self.log()))  # fmt: skip

    def log(self) -> str:
        """Return the end of what the item at work has printed."""
        return self._printed if self._log is None else end_of(self._log)

    def terminate(self) -> None:
        """Send SIGTERM if it has time to close its devices."""
        if self._limits.grace_s and self._process.is_alive():
            self._process.terminate()

    def end(self) -> None:
        """End the process and everything in its group, after the time that it has to close its devices."""
        if self._log is None:
            return
        if self._limits.grace_s and self.index < len(self.items):
            self.terminate()
            self._process.join(self._limits.grace_s)
        below: list[psutil.Process] = []
        with suppress(psutil.Error):
            below = psutil.Process(self._process.pid).children(recursive=True)
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        for one in (*below, self._process):
            with suppress(psutil.Error, OSError):
                one.kill()
        self._process.join()
        self._connection.close()
        self._printed, log, self._log = self.log(), self._log, None
        Path(log).unlink(missing_ok=True)


def _stacks(log: str) -> str:
    """Return what Python's fault handler wrote at the end of a log."""
    for mark in ("Fatal Python error", "Timeout ("):
        if mark in log:
            return mark + log.rpartition(mark)[2]
    return ""


def _context() -> Any:
    method = multiprocessing.get_start_method(allow_none=True)
    can_fork = "forkserver" in multiprocessing.get_all_start_methods() and hasattr(os, "fork")
    context = multiprocessing.get_context("forkserver" if can_fork and method != "spawn" else "spawn")
    context.set_forkserver_preload(_preload)
    return context


_preload = ["tactbench.core.pool.child"]


def start_server(*modules: str) -> None:
    """Have the fork server import `modules`, and start it now, so that it imports them while this process goes on."""
    _preload.extend(name for name in modules if name not in _preload)
    if _context().get_start_method() == "forkserver":
        from multiprocessing import forkserver

        with _without_main():
            forkserver.ensure_running()


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the main module, which children would import anew: a script need not guard what it does."""
    main = sys.modules["__main__"]
    hidden = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
    try:
        main.__spec__ = None
        with suppress(AttributeError):
            del main.__file__
        yield
    finally:
        for name, value in hidden.items():
            setattr(main, name, value)
