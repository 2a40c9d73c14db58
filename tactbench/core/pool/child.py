"""The child process of the pool, which carries out the items of one piece of work one after the other."""

from __future__ import annotations

import faulthandler
import io
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any

import psutil

from tactbench.core import errors
from tactbench.core.errors import OutOfMemory, Raised, TactbenchError, error_text

LOG_BYTES = 2**16
"""Largest number of bytes kept of a log, from its end."""


@dataclass(frozen=True)
class Limits:
    """Limits for one item of work (a cell or a recording); None means no limit."""

    timeout_s: float | None = None
    """Time limit [s of wall time]."""
    memory_mb: int | None = None
    """Memory limit [MB of 2**20 bytes], beyond the memory of the process when the item begins."""
    grace_s: float = 0.0
    """Time between SIGTERM and SIGKILL [s], in which a rig can close its devices."""


UNLIMITED = Limits()


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process and its descendants [MB of 2**20 bytes]; 0 if it has ended."""
    found = list[int]()
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                found.append(one.memory_info().rss)
    return sum(found) / 2**20


def run_child(
    work: Callable[[Any], Any],
    items: Sequence[Any],
    connection: Connection[Any, Any],
    log: str,
    folder: str,
    limits: Limits,
) -> None:
    """Carry out `work` for each item; send a message at the start of each item, and its result, to `connection`.

    Parameters
    ----------
    log
        Path of the file that standard output and standard error are redirected to.
    folder
        Working folder of the parent process, for relative paths in items.
    """
    printed = _redirect(log)
    if hasattr(os, "setsid"):
        with suppress(OSError):
            os.setsid()  # a process group, by which the parent ends it together with its own children
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _terminate)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    faulthandler.enable()
    os.chdir(folder)
    me = os.getpid()
    for item in items:
        os.ftruncate(printed, 0)  # the log holds the output of one item
        connection.send(("begun", resident_mb(me), ""))
        outcome = _carry_out(work, item, limits)
        if os.getpid() != me:
            os._exit(0)  # a child that the work forked and that returned from it
        for stream in (sys.stdout, sys.stderr):
            with suppress(Exception):
                stream.flush()
        try:
            connection.send(("ended", outcome, end_of(printed)))
        except Exception as error:  # it cannot be pickled
            connection.send(("ended", plain_error(error), end_of(printed)))
    with suppress(EOFError, OSError):
        connection.recv()  # the parent ends this process together with its group


def end_of(log: int) -> str:
    """Return the last `LOG_BYTES` of the present item's output, from the file descriptor `log`."""
    os.lseek(log, max(0, os.fstat(log).st_size - LOG_BYTES), os.SEEK_SET)
    return os.read(log, LOG_BYTES).decode(errors="replace")


def _carry_out(work: Callable[[Any], Any], item: Any, limits: Limits) -> Any:
    """Carry out an item; return its result or the error."""
    if limits.timeout_s is not None:  # the stacks at the end of its time go to the log
        faulthandler.dump_traceback_later(limits.timeout_s)
    try:
        return work(item)
    except _Terminated:
        os._exit(0)
    except BaseException as error:
        return plain_error(error)
    finally:
        faulthandler.cancel_dump_traceback_later()


def _redirect(log: str) -> int:
    opened = os.open(log, os.O_RDWR | os.O_APPEND)
    with suppress(OSError):  # both sides have it open: nothing is left, however they end
        os.unlink(log)  # noqa: PTH108
    for descriptor in (1, 2):
        os.dup2(opened, descriptor)
    if isinstance(sys.stdout, io.TextIOWrapper):
        # What was printed before a crash is in the log, in its order; a text that is no UTF-8 is written out.
        sys.stdout.reconfigure(line_buffering=True, errors="backslashreplace")
    return opened


class _Terminated(BaseException):
    """Exception raised on SIGTERM from the parent, so that contexts are left and devices closed."""


def _terminate(_number: int, _frame: FrameType | None) -> None:
    raise _Terminated


def _end_with_parent() -> None:
    """Wait until the parent process has ended for any reason, then end this process and its group."""
    multiprocessing.parent_process().join()  # type: ignore[union-attr]
    if hasattr(os, "killpg"):
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def plain_error(error: BaseException) -> TactbenchError:
    """Return `error` as a type of tactbench, which can be sent to a process without the plugins' classes."""
    where = "".join(traceback.format_exception(error))
    if isinstance(error, TactbenchError) and getattr(errors, type(error).__name__, None) is type(error):
        error.traceback_text = error.traceback_text or where
        return error
    if isinstance(error, MemoryError):
        return OutOfMemory("Memory ran out.", hint="Give a smaller --jobs.", traceback_text=where)
    return Raised(error_text(error), traceback_text=where)
