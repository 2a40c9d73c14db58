"""The process pool: each item of work in a child process, within limits."""

from __future__ import annotations

import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass
from multiprocessing.connection import wait
from typing import TypeVar

from tactbench.core.pool.limits import UNLIMITED, Limits
from tactbench.core.pool.processes import (
    await_fork_server_end,
    can_fork,
    children,
    interrupts_blocked,
    kill_below,
    kill_orphans,
    set_subreaper,
)
from tactbench.core.pool.worker import PENDING, Worker

T = TypeVar("T")
R = TypeVar("R")

_SERVER_ENDS_S = 5.0
"""Seconds that a fork server which refuses a start may take to end: it was killed, and a busy machine is slow."""


@dataclass(frozen=True)
class Pool:
    """Up to `jobs` child processes.

    Parameters
    ----------
    jobs
        Items carried out at the same time.
    limits
        What each may take; its process is ended beyond.
    reuse
        Whether a process gets another item once it is through with one, which then finds what that has loaded. All
        items are taken before the first begins. Else each has a process of its own, which shares what this process
        holds when the item is taken, if it forks.
    fork
        Whether this process forks, which must have one thread. Else a fork server of `multiprocessing` does, which
        has imported `PRELOAD`; work and items are pickled. None: it forks where it may.
    is_needed
        Asked while items are at work whether anybody still waits for them; the iteration ends where nobody does.

    Notes
    -----
    The process of an item is the subreaper of whatever that starts, and is ended after it. What it leaves behind when
    it crashes becomes a child of this process and is ended then.
    """

    jobs: int = 1
    limits: Limits = UNLIMITED
    _: KW_ONLY
    reuse: bool = False
    fork: bool | None = None
    is_needed: Callable[[], bool] = lambda: True

    def each(self, work: Callable[[T], R], items: Iterable[T]) -> Generator[tuple[T, R | BaseException], None, None]:
        """Yield every item with its result or what stopped it, in the order in which they end.

        Notes
        -----
        An item whose process ends before it has begun gets another one, once.
        """
        every = list(items) if self.reuse else []
        coming = enumerate(every) if self.reuse else ((0, item) for item in items)
        again: deque[tuple[int, T]] = deque()
        """Items whose processes ended before they had begun."""
        busy: list[Worker] = []
        idle: list[Worker] = []
        fork = can_fork() if self.fork is None else self.fork
        with _children_of_items(busy, idle) as spared:
            while True:
                while len(busy) < self.jobs:
                    second = bool(again)
                    index, item = again.popleft() if again else next(coming, (-1, None))
                    if index < 0:
                        break
                    try:
                        with interrupts_blocked():
                            worker = idle.pop() if idle else Worker(work, every or [item], self.limits, fork)
                            busy.append(worker)
                            worker.begin(index, second)
                    except Exception as error:
                        if isinstance(error, ConnectionError | EOFError) and not second:
                            await_fork_server_end(_SERVER_ENDS_S)
                            again.append((index, item))  # type: ignore[arg-type]
                        else:  # it cannot be pickled, or the system starts no more processes
                            yield item, error  # type: ignore[misc]
                if not busy or not self.is_needed():
                    return
                wait([one for worker in busy for one in worker.waits_on], min(worker.wait_s() for worker in busy))
                for worker in list(busy):
                    outcome = worker.outcome()
                    if outcome is PENDING:
                        continue
                    item = worker.items[worker.index]
                    retry = not (worker.begun or worker.second or worker.alive)
                    self._end_item(worker, busy, idle)
                    kill_orphans(spared)
                    if retry:
                        again.append((worker.index, item))
                    else:
                        yield item, outcome

    def _end_item(self, worker: Worker, busy: list[Worker], idle: list[Worker]) -> None:
        """End whatever an item that is over has started, and its process unless another item may have it."""
        with interrupts_blocked():
            busy.remove(worker)
            if self.reuse and worker.alive:
                kill_below(worker.pid)
                idle.append(worker)
            else:
                worker.close()


@contextmanager
def _children_of_items(busy: list[Worker], idle: list[Worker]) -> Iterator[set[int]]:
    """Have orphans of items become children of this process; at the end, leave no process of an item.

    Yields the children that were there before.
    """
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGCHLD) == signal.SIG_IGN:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # else the system reaps children, and their exit codes are lost
    before: bool | None = None
    spared: set[int] = set()
    try:
        with interrupts_blocked():
            spared |= children(os.getpid())
            before = set_subreaper(True)
        yield spared
    finally:
        try:
            for worker in busy:
                worker.give_grace()
        finally:
            with interrupts_blocked():
                for worker in (*busy, *idle):
                    worker.close()
                if before is not None:
                    kill_orphans(spared)
                    set_subreaper(before)
