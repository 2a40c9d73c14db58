"""Items of work one after the other, in this very process: what a debugger can look into."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from tactbench.core.errors import CellStopped
from tactbench.core.pool.endings import out_of_memory, too_slow
from tactbench.core.pool.limits import UNLIMITED, Limits
from tactbench.core.pool.log import open_log, printing_to, tail
from tactbench.core.pool.memory import data_limit
from tactbench.core.pool.message import dump_error, load_error
from tactbench.core.pool.pool import R, T

AGAIN_S = 0.2
"""Seconds until whoever swallowed the alarm hears it again."""


class InProcess:
    """One after the other, here.

    An exception, ``sys.exit`` and a KeyboardInterrupt that no user sent become results. What ends the process ends the
    run: use it for one item.

    Parameters
    ----------
    limits
        Soft ones: the time is an alarm between two instructions of Python, and only where the main thread does the
        work; the memory is what may be asked for, not what is used.
    """

    def __init__(self, limits: Limits = UNLIMITED) -> None:
        self._limits = limits

    def each(self, work: Callable[[T], R], items: Iterable[T]) -> Generator[tuple[T, R | BaseException], None, None]:
        """Yield every item with its result or what stopped it."""
        for item in items:
            yield item, self._one(work, item)

    def _one(self, work: Callable[[T], R], item: T) -> R | BaseException:
        log = open_log()
        outcome: R | BaseException
        here, began_s = os.getpid(), time.monotonic()
        with printing_to(log), _interrupts_noted() as interrupted:
            alarm = _Alarm(self._limits.timeout_s)
            try:
                with alarm, data_limit(self._limits.memory_mb):
                    outcome = work(item)
            except _Late:
                outcome = too_slow(self._limits)
            except MemoryError as error:
                outcome = out_of_memory(self._limits, error)
            except BaseException as error:
                outcome = load_error(dump_error(error))
            if os.getpid() != here:
                os._exit(0)  # a child that the work forked, and that returned from it: it has nothing to say here
        log_text = tail(log)
        os.close(log)
        if interrupted:
            raise KeyboardInterrupt
        if isinstance(outcome, CellStopped):
            outcome.log, outcome.spent_s = log_text, time.monotonic() - began_s
        return outcome


class _Late(BaseException):
    """The alarm: no `except Exception` of a plugin swallows it."""


class _Alarm:
    """Raises `_Late` in the main thread after some seconds, again and again until it is out of the context."""

    def __init__(self, seconds: float | None) -> None:
        usable = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
        self._seconds = seconds if usable else None
        self._armed = False
        self._before: Any = None

    def __enter__(self) -> None:
        if self._seconds is not None:
            self._before = signal.signal(signal.SIGALRM, self._ring)
            self._armed = True
            signal.setitimer(signal.ITIMER_REAL, self._seconds, AGAIN_S)

    def __exit__(self, *_: object) -> None:
        if self._seconds is not None:
            self._armed = False
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, self._before)

    def _ring(self, _number: int, _frame: FrameType | None) -> None:
        if self._armed:
            raise _Late


@contextmanager
def _interrupts_noted() -> Iterator[list[int]]:
    """Tell the user's Ctrl-C, which ends the run, from a plugin that raises KeyboardInterrupt itself."""
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield came
    finally:
        signal.signal(signal.SIGINT, before)
