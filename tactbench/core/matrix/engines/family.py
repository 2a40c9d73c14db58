"""Processes and their descendants: who dies with whom, and who is left over. Linux; elsewhere nothing is known."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

# prctl(2)
_SET_PDEATHSIG, _SET_CHILD_SUBREAPER, _GET_CHILD_SUBREAPER = 1, 36, 37

_GENERATIONS = 64
"""Of processes that leave each other behind: as many as nobody nests."""

_ours: set[int] = set()
"""Processes that engines of this process have started and not yet buried."""


def can_fork() -> bool:
    """Return whether this process may fork: it is its only thread.

    A fork of a process with threads copies their locks in an undefined state. The command line keeps BLAS at one
    thread, so that there are none.
    """
    try:
        return len(list(Path("/proc/self/task").iterdir())) == 1
    except OSError:
        return False


def die_with_parent(parent: int) -> None:
    """Have this process killed when its parent ends, however that ends; end it now if that has happened already."""
    _prctl(_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def born(pid: int) -> None:
    """Remember a process as one that an engine looks after."""
    _ours.add(pid)


def kill(pid: int) -> None:
    """Kill what is left of a process, of its group, and of whatever is below it."""
    kill_below(pid)  # first: what is below a process that has ended is below another one then
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)
    with suppress(ProcessLookupError, PermissionError):
        os.kill(pid, signal.SIGKILL)  # it may not have founded its group yet


def kill_below(pid: int) -> None:
    """Kill the processes below `pid`.

    Who is killed starts nobody any more, but may have done so while we looked: there may be another generation, at
    most as many as nobody nests.
    """
    known: set[int] = set()
    for _ in range(_GENERATIONS):
        found = set(descendants(pid)) - known
        if not found:
            return
        known |= found
        for one in found:
            _kill_child_of({pid, *known}, one)


def _kill_child_of(parents: set[int], pid: int) -> None:
    """Kill process `pid` if its parent is among `parents`.

    Its parent may have reaped it since it was listed, and the system may have given its number to a process that has
    nothing to do with us. A file descriptor of a process never names another one: it is opened first, then the parent
    is looked at, then the signal is sent by it (pidfd_open(2)).
    """
    with suppress(ProcessLookupError, PermissionError):
        descriptor = os.pidfd_open(pid)
        try:
            if _parent(pid) in parents:
                signal.pidfd_send_signal(descriptor, signal.SIGKILL)
        finally:
            os.close(descriptor)


def buried(pid: int) -> int:
    """Wait for the end of a process that an engine has started; return its wait status."""
    _, status = os.waitpid(pid, 0)
    _ours.discard(pid)
    return status


def bury_ended() -> None:
    """Bury the children of this process that have ended: for the process of an item only, where all are the item's."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def descendants(pid: int) -> list[int]:
    """Return the processes below `pid`, itself not among them."""
    found: list[int] = []
    for child in _children(pid):
        found += [child, *descendants(child)]
    return found


def adopt(whether: int = 1) -> int:
    """Have this process become the parent of what is left behind below it, or not; return what it was before."""
    before = _get_subreaper()
    _prctl(_SET_CHILD_SUBREAPER, whether)
    return before


def mark(engine: int) -> None:
    """Mark this process, and all that it starts, as belonging to an item of the process `engine`.

    What an item leaves behind becomes a child of the engine's process, and must be told from children that this
    process started for other reasons, at whatever time. Resource limits are inherited over fork and exec whatever a
    process does with its group, session, environment and files, and others may read them. The limit used is that of
    POSIX message queues (getrlimit(2), RLIMIT_MSGQUEUE, bytes), which nothing here uses.
    """
    import resource

    with suppress(AttributeError, OSError, ValueError):
        _, hard = resource.getrlimit(resource.RLIMIT_MSGQUEUE)
        resource.setrlimit(resource.RLIMIT_MSGQUEUE, (_mark_of(engine), hard))


def _mark_of(engine: int) -> int:
    return engine % 2**16


def _marked(pid: int) -> bool:
    """Return whether process `pid` was started by an item of this process."""
    import resource

    with suppress(AttributeError, OSError, ValueError):
        return resource.prlimit(pid, resource.RLIMIT_MSGQUEUE)[0] == _mark_of(os.getpid())
    return False


def bury_orphans() -> None:
    """End the children of this process that an item which is over has left behind; other children are left alone.

    A parent that is killed hands its children on: ended generation by generation.
    """
    for _ in range(_GENERATIONS):
        orphans = {pid for pid in own_children() - _ours if _marked(pid)}
        if not orphans:
            return
        for pid in orphans:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
            with suppress(ChildProcessError):
                os.waitpid(pid, 0)


def own_children() -> set[int]:
    """Return the children of this process."""
    return set(_children(os.getpid()))


def _parent(pid: int) -> int:
    """Return the parent of a process; 0 where it is not known."""
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])  # proc_pid_stat(5)
    except (OSError, IndexError, ValueError):
        return 0


def _children(pid: int) -> list[int]:
    found: list[int] = []
    try:
        for task in os.listdir(f"/proc/{pid}/task"):  # noqa: PTH208  (names, and quicker)
            found += [int(word) for word in Path(f"/proc/{pid}/task/{task}/children").read_text().split()]
    except OSError:
        pass  # it has ended, or the system does not tell
    return found


@contextmanager
def interrupts_held_back() -> Iterator[None]:
    """Start processes that are deaf to Ctrl-C from their first instruction on: it is the parent that ends them.

    A terminal sends the interrupt to all of them at once, and one that is still starting would print where it was. The
    signal is blocked, which children inherit; one that comes meanwhile waits here and is delivered afterwards.
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
def _library() -> Any:
    import ctypes

    return ctypes.CDLL(None)


def _prctl(option: int, value: int) -> None:
    import ctypes

    with suppress(AttributeError, OSError):
        _library().prctl(option, ctypes.c_ulong(value), 0, 0, 0)


def _get_subreaper() -> int:
    import ctypes

    value = ctypes.c_int(0)
    with suppress(AttributeError, OSError):
        _library().prctl(_GET_CHILD_SUBREAPER, ctypes.byref(value), 0, 0, 0)
    return value.value
