"""Life in a forked process: deaf to Ctrl-C, bound to its parent, and never heard twice."""

from __future__ import annotations

import faulthandler
import gc
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from types import FrameType
from typing import Any, NoReturn

from tactbench.core.matrix.engines.family import adopt, bury_ended, die_with_parent, mark
from tactbench.core.matrix.engines.limits import Limits
from tactbench.core.matrix.engines.log import flush, print_to
from tactbench.core.matrix.engines.memory import data_limit, first_to_go
from tactbench.core.matrix.engines.message import Message, Told
from tactbench.core.matrix.engines.verdict import out_of_memory

WHERE_ARE_YOU = getattr(signal, "SIGUSR2", None)
"""Has the process write to its log where it is."""


def live(
    work: Callable[[Any], Any],
    items: Iterator[Any],
    link: int,
    log: int,
    limits: Limits,
    parent: int,
    foreign: Iterable[int],
) -> NoReturn:
    """Carry out `work` for each of `items` and send what comes of each over `link`; never return.

    `parent` is the process that forked this one, `foreign` are descriptors that are its own business.
    """
    try:
        for descriptor in foreign:
            with suppress(OSError):
                os.close(descriptor)
        _settle(log, limits, parent)
        me = os.getpid()
        for item in items:
            bury_ended()  # what the item before has left here
            os.ftruncate(log, 0)
            message = _carried_out(work, item, limits)
            if os.getpid() != me:
                os._exit(0)  # forked by the work, and back from it: only the process that was asked may answer
            flush()
            _send(message, link)
    except BaseException as error:
        # Nothing of ours may reach the code that stood around the fork.
        os.write(2, f"{type(error).__name__}: {error}\n".encode())
        os._exit(70)
    os._exit(0)


def _settle(log: int, limits: Limits, parent: int) -> None:
    os.setsid()  # what it starts is found, and ended, by its group
    die_with_parent(parent)
    mark(parent)  # whatever it starts is known for its own
    adopt()  # what it leaves behind stays below it while it lives: nobody takes it for what another item has left
    signal.set_wakeup_fd(-1)
    for number in (signal.SIGALRM, signal.SIGCHLD, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end if limits.grace_s else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, set())
    print_to(log)
    gc.freeze()  # what the parent made is shared as long as nobody walks over it
    first_to_go()
    _no_core_dump()
    faulthandler.enable(file=2)
    if WHERE_ARE_YOU is not None:
        faulthandler.register(WHERE_ARE_YOU, file=2, all_threads=True)


class _Ended(BaseException):
    """The parent wants this process to end, and leaves it time to close what is open."""


def _end(_number: int, _frame: FrameType | None) -> None:
    raise _Ended


def _no_core_dump() -> None:
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, hard))


def _carried_out(work: Callable[[Any], Any], item: Any, limits: Limits) -> Message:
    began = time.perf_counter()
    result: Any
    try:
        with data_limit(limits.memory_mb):
            result = work(item)
    except _Ended:
        os._exit(0)
    except MemoryError as error:
        result = Told.of(out_of_memory(limits, error, "".join(traceback.format_exception(error))))
    except BaseException as error:
        result = Told.of(error)
    return Message(result, time.perf_counter() - began)


def _send(message: Message, link: int) -> None:
    try:
        message.send(link)
    except OSError:
        raise  # nobody listens any more
    except Exception as error:
        sys.stderr.write(f"The result cannot be handed over: {error}\n")
        Message(Told.of(error), message.spent_s).send(link)
