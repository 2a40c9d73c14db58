"""The child process's side: it carries out the items that its parent names, one at a time, and never returns."""

from __future__ import annotations

import faulthandler
import gc
import os
import signal
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any, NoReturn

from tactbench.core.pool.endings import out_of_memory
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.log import flush, print_to
from tactbench.core.pool.memory import data_limit, first_to_go
from tactbench.core.pool.message import dump_error, pack
from tactbench.core.pool.processes import die_with_parent, reap_finished, set_subreaper

WHERE_SIGNAL = getattr(signal, "SIGUSR2", None)
"""Has the process write the stack of every thread to its log."""


def run_child(
    work: Callable[[Any], Any],
    items: Sequence[Any],
    connection: Connection[Any, Any],
    log: Connection[Any, Any],
    limits: Limits,
    parent: int | None,
) -> NoReturn:
    """Carry out `work` for each item whose index comes through `connection`; send what comes of it back.

    Parameters
    ----------
    log
        Holds the descriptor of the log.
    parent
        The process that forked this one; None: a fork server did.
    """
    code = 70
    try:
        _set_up(log.fileno(), limits, parent)
        me = os.getpid()
        while True:
            item = items[int(connection.recv_bytes())]
            reap_finished()  # of the item before
            os.ftruncate(log.fileno(), 0)
            _send(connection, pack({"begun": True}))
            message = _carry_out(work, item, limits)
            if os.getpid() != me:
                os._exit(0)  # forked by the work, and returned from it: only the child itself answers
            flush()
            _send(connection, message)
    except EOFError:
        code = 0  # the parent asks for no more
    except BaseException as error:
        os.write(2, f"{type(error).__name__}: {error}\n".encode(errors="replace"))
    finally:
        os._exit(code)


def _set_up(log: int, limits: Limits, parent: int | None) -> None:
    os.setsid()  # its descendants are in other sessions than the parent's own children
    die_with_parent(os.getppid() if parent is None else parent)
    set_subreaper(True)  # orphans below it stay below it while it lives
    server = getattr(forkserver, "_forkserver", None)
    alive = getattr(server, "_forkserver_alive_fd", None)
    if alive is not None:
        os.close(alive)  # as long as it is open here, a fork server outlives the process that started it
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGALRM, signal.SIGCHLD, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end if limits.grace_s else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, set())
    print_to(log)
    gc.freeze()  # pages shared with the parent are not written to by the garbage collector
    first_to_go()
    _no_core_dump()
    faulthandler.enable(file=2)
    if WHERE_SIGNAL is not None:
        faulthandler.register(WHERE_SIGNAL, file=2, all_threads=True)


class _Ended(BaseException):
    """The parent wants this process to end, and leaves it time to close what is open."""


def _end(_number: int, _frame: FrameType | None) -> None:
    raise _Ended


def _no_core_dump() -> None:
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, hard))


def _carry_out(work: Callable[[Any], Any], item: Any, limits: Limits) -> bytes:
    """Return the message that says what came of an item."""
    began = time.perf_counter()
    spent = None
    try:
        with data_limit(limits.memory_mb):
            value = work(item)
        spent = time.perf_counter() - began
        return pack({"value": value, "spent_s": spent})
    except _Ended:
        os._exit(0)
    except MemoryError as error:
        text = dump_error(out_of_memory(limits, error, "".join(traceback.format_exception(error))))
    except BaseException as error:
        text = dump_error(error)
        if spent is not None:
            text["message"] = f"Its result cannot be sent as JSON and arrays: {text['message']}"
    return pack({"error": text, "spent_s": time.perf_counter() - began if spent is None else spent})


def _send(connection: Connection[Any, Any], message: bytes) -> None:
    left = memoryview(message)
    with suppress(InterruptedError):
        while left:
            left = left[os.write(connection.fileno(), left) :]
