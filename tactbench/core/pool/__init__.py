"""The process pool: carries out work in child processes, within limits of time and memory, or in this process."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Self

import psutil

from tactbench.core.errors import CellStopped, Crashed, OutOfMemory, TimedOut
from tactbench.core.interrupts import interrupts_held
from tactbench.core.pool.child import UNLIMITED, Limits, end_of, plain_error, resident_mb, run_child

__all__ = ["UNLIMITED", "Engine", "InProcess", "Limits", "Pool", "preload"]

START_S = 60.0
"""Time limit [s] for a process to begin with its first item; with `spawn` it includes the import of libraries."""
POLL_S = 0.05
"""Time between two checks of a child's memory and time [s]."""
KILL_DELAY_S = 0.2
"""Time between an item's time limit, at which its stacks are logged, and its end by force [s]."""
MOST_LOG_BYTES = 2**24
"""Size [bytes] beyond which a log is emptied."""


class Engine:
    """Base of engines that carry out pieces of work (sequences of items); leaving its context drops waiting pieces."""

    log = ""
    """Last part of the printed output of the item whose outcome was yielded last."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Callable[[Any], Any], Sequence[Any]]] = deque()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._waiting.clear()

    def submit(self, work: Callable[[Any], Any], items: Sequence[Any]) -> None:
        """Queue `work` to be called for each of `items`; may be called while `outcomes` is iterated."""
        self._waiting.append((work, items))

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Yield every submitted item with its result or the error that stopped it, in the order in which they end."""
        raise NotImplementedError

    def each(self, work: Callable[[Any], Any], items: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        """Carry out `work` for every item, as one piece of work, and yield each item with its outcome."""
        with self:
            self.submit(work, list(items))
            yield from self.outcomes()


class InProcess(Engine):
    """Engine that carries out items in this process without limits, for use with a debugger; Ctrl-C ends it."""

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Yield every item with its result or the error that stopped it."""
        while self._waiting:
            work, items = self._waiting.popleft()
            for item in items:
                try:
                    outcome = work(item)
                except (Exception, SystemExit) as error:
                    outcome = plain_error(error)
                yield item, outcome


class Pool(Engine):
    """Engine of up to `jobs` child processes; each carries out the items of one piece of work in order.

    If an item raises, crashes, hangs or takes too much memory, its outcome is an error, and further items get a
    new process.

    Parameters
    ----------
    jobs
        Number of pieces of work carried out at the same time.
    limits
        Limits of time and memory for one item.

    Notes
    -----
    Processes come from the fork server of `multiprocessing`, or are spawned if there is none or `spawn` is the start
    method. Work, items and results are pickled; results must be of types of the standard library, numpy or tactbench.
    One thread of this process supervises each child.
    """

    def __init__(self, jobs: int = 1, limits: Limits = UNLIMITED) -> None:
        super().__init__()
        self.jobs, self.limits = jobs, limits
        self._ended: SimpleQueue[tuple[Any, Any, str] | None] = SimpleQueue()
        """Queue of (item, outcome, log); None marks the end of a piece of work."""
        self._threads: list[threading.Thread] = []
        self._abandoned = threading.Event()

    def __exit__(self, *_: object) -> None:
        """End every child process."""
        with interrupts_held():
            super().__exit__()
            self._abandoned.set()
            for thread in self._threads:
                thread.join()

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Yield every submitted item with its result or the error that stopped it, in the order in which they end."""
        running = 0
        while self._waiting or running:
            while self._waiting and running < self.jobs:
                thread = threading.Thread(target=self._carry_out, args=self._waiting.popleft(), daemon=True)
                self._threads.append(thread)
                thread.start()
                running += 1
            try:
                ended = self._ended.get(timeout=POLL_S)  # on Windows, Ctrl-C does not interrupt a wait without end
            except Empty:
                continue
            if ended is None:
                running -= 1
            else:
                item, outcome, self.log = ended
                yield item, outcome

    def _carry_out(self, work: Callable[[Any], Any], items: Sequence[Any]) -> None:
        """Carry out a piece of work in one child process after the other, until each of its items has an outcome."""
        left = deque(items)
        try:
            while left and not self._abandoned.is_set():
                child = _Child(work, list(left), self.limits)
                try:
                    while left and not child.over and not self._abandoned.is_set():
                        ended = child.outcome(self._abandoned)
                        if ended is not None:
                            self._ended.put((left.popleft(), *ended))
                finally:
                    child.end(unfinished=bool(left))
        except Exception as error:  # it cannot be pickled, or the system starts no more processes
            for item in left:
                self._ended.put((item, plain_error(error), ""))
        finally:
            self._ended.put(None)


_starting = threading.Lock()


class _Child:
    """A child process of the pool, seen from the parent process."""

    def __init__(self, work: Callable[[Any], Any], items: Sequence[Any], limits: Limits) -> None:
        self.over = False
        """True if the process has ended."""
        self._limits, self._times_above = limits, 0
        context = _context()
        self._connection, theirs = context.Pipe()
        self._log, self._log_name = tempfile.mkstemp(prefix="tactbench-", suffix=".log")
        try:
            arguments = (work, items, theirs, self._log_name, str(Path.cwd()), limits)
            self._process = context.Process(target=run_child, args=arguments)
            _start(self._process.start)
        except BaseException:
            self._close()
            raise
        finally:
            theirs.close()

    def outcome(self, abandoned: threading.Event) -> tuple[Any, str] | None:
        """Wait for the next item; return its result or error and its log, or None if the pool is being closed."""
        began_s, shared_mb = time.monotonic(), None
        while not abandoned.is_set():
            try:
                if self._connection.poll(POLL_S):
                    kind, value, log = self._connection.recv()
                    if kind == "ended":
                        return _with_log(value, log, began_s)
                    began_s, shared_mb = time.monotonic(), value
                stopped = self._beyond_limits(time.monotonic() - began_s, shared_mb)
            except (EOFError, OSError):  # it has ended, or closed the connection
                self._process.join(1.0)
                stopped = self._crashed()
            if stopped is not None:
                self._kill(unfinished=True)
                self.over = True
                return _with_log(stopped, end_of(self._log), began_s)
        return None

    def _beyond_limits(self, spent_s: float, shared_mb: float | None) -> CellStopped | None:
        """Return the error for the present item if it exceeds its limits, else None."""
        if os.fstat(self._log).st_size > MOST_LOG_BYTES:
            os.ftruncate(self._log, 0)
        timeout_s, memory_mb = self._limits.timeout_s, self._limits.memory_mb
        if shared_mb is None:  # it has not begun
            late = Crashed(f"The process did not start within {START_S:g} s.", hint="Give a smaller --jobs.")
            return late if spent_s > START_S else None
        if timeout_s is not None and spent_s > timeout_s + KILL_DELAY_S:
            text = f"Stopped after the time limit of {timeout_s:g} s."
            return TimedOut(text, hint="Give a larger --timeout SECONDS.")
        above = memory_mb is not None and resident_mb(self._process.pid) - shared_mb > memory_mb
        # For a moment, a process that is being started shares the memory of its parent, which then counts twice.
        self._times_above = self._times_above + 1 if above else 0
        if self._times_above > 1:
            return OutOfMemory(f"Stopped: it used more than {memory_mb} MB of memory.", hint="Give a larger --memory.")
        return None

    def _crashed(self) -> Crashed:
        code = self._process.exitcode or 0
        if code < 0:
            hint = "See the process's log. If memory was short, give a smaller --jobs, or a limit with --memory MB."
            text = f"The process was ended by signal {-code} ({signal.Signals(-code).name})."
            return Crashed(text, hint=hint, signal=-code)
        text = f"The process ended with exit code {code} and gave no result."
        return Crashed(text, hint="A plugin may have called os._exit or closed a file of the process.")

    def end(self, *, unfinished: bool) -> None:
        """End the process and its group; if `unfinished`, after the grace time, in which devices can be closed."""
        if not self.over:
            self._kill(unfinished=unfinished)
        self._close()

    def _close(self) -> None:
        self._connection.close()
        os.close(self._log)
        Path(self._log_name).unlink(missing_ok=True)

    def _kill(self, *, unfinished: bool) -> None:
        if self._limits.grace_s and unfinished:
            self._process.terminate()
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


def _with_log(value: Any, log: str, began_s: float) -> tuple[Any, str]:
    """Return an outcome and its log; an error is given the log and the stacks written by Python's fault handler."""
    if isinstance(value, CellStopped):
        value.log, value.spent_s = log, time.monotonic() - began_s
        marks = [mark for mark in ("Fatal Python error", "Timeout (") if mark in log]
        if marks and not value.traceback_text:
            value.traceback_text = marks[0] + log.rpartition(marks[0])[2]
    return value, log


def _context() -> Any:
    method = multiprocessing.get_start_method(allow_none=True)
    can_fork = "forkserver" in multiprocessing.get_all_start_methods() and hasattr(os, "fork")
    context = multiprocessing.get_context("forkserver" if can_fork and method != "spawn" else "spawn")
    context.set_forkserver_preload(_preload)
    return context


_preload = ["tactbench.core.pool.child"]


def preload(*modules: str) -> None:
    """Add `modules` to the modules that the fork server imports when the first child process is started."""
    _preload.extend(name for name in modules if name not in _preload)


def _start(start: Callable[[], None]) -> None:
    """Start a process that does not import the main module, so that scripts need no ``__main__`` guard."""
    main = sys.modules["__main__"]
    with _starting:
        hidden = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
        try:
            main.__spec__ = None
            main.__dict__.pop("__file__", None)
            start()
        finally:
            vars(main).update(hidden)
