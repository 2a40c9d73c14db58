"""Uniform handling of Ctrl-C, SIGTERM and SIGHUP: each raises KeyboardInterrupt in the main thread."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
ONE_S = 1.0
"""Time within which repeated signals count as one [s], as a closed terminal or a batch system sends several."""

_raised_s = -ONE_S


class Interrupted(KeyboardInterrupt):
    """An interrupt by a signal, with its number; after a plain KeyboardInterrupt, Python may end by SIGINT."""


def interrupt(number: int, _frame: FrameType | None) -> None:
    """Raise Interrupted, as the handler of SIGTERM and SIGHUP."""
    global _raised_s
    if time.monotonic() - _raised_s >= ONE_S:
        _raised_s = time.monotonic()
        raise Interrupted(number)


def end_alike() -> None:
    """Make SIGTERM and SIGHUP raise KeyboardInterrupt, as Ctrl-C does; an ignored signal (``nohup``) stays ignored."""
    for number in _handled(signal.SIG_DFL):
        signal.signal(number, interrupt)
    for number in ENDING:  # what is removed when Python ends is removed whole
        atexit.register(signal.signal, number, signal.SIG_IGN)
    sys.unraisablehook = _send_again


def _send_again(dropped: Any) -> None:
    """Send a signal again if Python dropped its exception, as in a weak reference's callback or in ``__del__``."""
    global _raised_s
    if isinstance(dropped.exc_value, KeyboardInterrupt):
        _raised_s = -ONE_S
        number = dropped.exc_value.args[0] if dropped.exc_value.args else signal.SIGINT
        threading.Timer(0.01, os.kill, (os.getpid(), number)).start()
    else:
        sys.__unraisablehook__(dropped)


@contextmanager
def one_interrupt() -> Iterator[Callable[[], None]]:
    """Return a context in which the first signal raises KeyboardInterrupt and later signals are ignored.

    It yields a function that makes all later signals ignored. Other threads and other handlers are not affected.
    """

    def ignore() -> None:
        for number in before:
            signal.signal(number, signal.SIG_IGN)

    def first(number: int, _frame: FrameType | None) -> None:
        ignore()
        raise Interrupted(number)

    with _handling(first) as before:
        yield ignore


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Return a context that delays signals until its end, where the first delayed signal takes effect."""
    came: list[int] = []
    with _handling(lambda number, _frame: came.append(number)) as before:
        yield
    for number in came[:1]:
        before[number](number, None)


@contextmanager
def _handling(handler: Callable[[int, FrameType | None], None]) -> Iterator[dict[int, Any]]:
    before = _handled(signal.default_int_handler, interrupt)
    for number in before:
        signal.signal(number, handler)
    try:
        yield before
    finally:
        for number, old in before.items():
            signal.signal(number, old)


def _handled(*by: Any) -> dict[int, Any]:
    """Return the signals that have one of the given handlers, with the handler; empty outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    return {number: handler for number in ENDING if (handler := signal.getsignal(number)) in by}
