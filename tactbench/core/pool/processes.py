"""Trees of processes: descendants, orphans, and who ends with whom. Linux; elsewhere nothing is known of them."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from multiprocessing import connection, forkserver
from pathlib import Path

# prctl(2)
_SET_PDEATHSIG, _SET_CHILD_SUBREAPER, _GET_CHILD_SUBREAPER = 1, 36, 37

_GENERATIONS = 64
"""Processes that are killed may have started others meanwhile; so often is looked again."""


def can_fork() -> bool:
    """Return whether this process may fork: it has one thread.

    A fork of a process with threads copies their locks in an undefined state. The command line keeps BLAS at one
    thread, so that there are none.
    """
    try:
        return len(list(Path("/proc/self/task").iterdir())) == 1
    except OSError:
        return False


def die_with_parent(parent: int) -> None:
    """Have this process killed when its parent ends, however that ends; end it now if that has happened already."""
    with suppress(AttributeError, OSError):
        c_library().prctl(_SET_PDEATHSIG, ctypes.c_ulong(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


def await_fork_server_end(seconds: float) -> None:
    """Wait until the fork server of this process has ended, at most so long; the next start then makes another.

    One that is killed closes its socket first and ends a moment later: between the two it counts as running, and
    refuses whoever asks.
    """
    pid: int | None = getattr(forkserver._forkserver, "_forkserver_pid", None)
    if pid is None:
        return
    with suppress(AttributeError, OSError):  # the system has no such call, or it has ended and was reaped
        descriptor = os.pidfd_open(pid)
        try:
            connection.wait([descriptor], seconds)
        finally:
            os.close(descriptor)


def set_subreaper(whether: bool) -> bool:
    """Have orphans below this process become its children, or not; return what it was before."""
    value = ctypes.c_int(0)
    with suppress(AttributeError, OSError):
        c_library().prctl(_GET_CHILD_SUBREAPER, ctypes.byref(value), 0, 0, 0)
        c_library().prctl(_SET_CHILD_SUBREAPER, ctypes.c_ulong(whether), 0, 0, 0)
    return bool(value.value)


def kill_tree(pid: int) -> None:
    """Kill a process, its group and all below it; first those below, which have another parent once it has ended."""
    kill_below(pid)
    for kill in (os.killpg, os.kill):
        with suppress(ProcessLookupError, PermissionError):
            kill(pid, signal.SIGKILL)


def kill_below(pid: int) -> None:
    """Kill the descendants of a process."""
    known: set[int] = set()
    for _ in range(_GENERATIONS):
        found = set(descendants(pid)) - known
        if not found:
            return
        known |= found
        for one in found:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(one, signal.SIGKILL)


def reap_finished() -> None:
    """Reap the children of this process that have ended: for a child of the pool, whose children are its item's."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def kill_orphans(spared: set[int]) -> None:
    """Kill and reap the orphans of items that are over, which are children of this process now.

    Every child of the pool begins a session of its own, so that orphans are in another session than this process. The
    children that it has started for other purposes are in its own, or among `spared`, or known to `multiprocessing`.
    """
    for _ in range(_GENERATIONS):
        known = spared | {one.pid for one in multiprocessing.active_children()}
        orphans = {pid for pid in children(os.getpid()) - known if _foreign(pid)}
        if not orphans:
            return
        for pid in orphans:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
            with suppress(ChildProcessError):
                os.waitpid(pid, 0)


def _foreign(pid: int) -> bool:
    try:
        return os.getsid(pid) != os.getsid(0)
    except OSError:
        return False


def descendants(pid: int) -> list[int]:
    """Return the processes below `pid`, itself not among them."""
    found: list[int] = []
    for child in children(pid):
        found += [child, *descendants(child)]
    return found


def children(pid: int) -> set[int]:
    """Return the children of a process."""
    found: set[int] = set()
    try:
        for task in os.listdir(f"/proc/{pid}/task"):  # noqa: PTH208  (names, and quicker)
            found |= {int(word) for word in Path(f"/proc/{pid}/task/{task}/children").read_text().split()}
    except OSError:
        pass  # it has ended, or the system does not tell
    return found


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C: child processes inherit that, and one that comes meanwhile is delivered afterwards.

    A terminal sends the interrupt to all processes at once, and a child that is still starting would print where it
    was.
    """
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@lru_cache(maxsize=1)
def c_library() -> ctypes.CDLL:
    """Return the C library of this process."""
    return ctypes.CDLL(None)
