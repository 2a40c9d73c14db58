"""Each item in a forked child of this single-threaded process."""

from __future__ import annotations

import os
import pickle
import signal
import tempfile
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from tactbench.core.errors import Crashed, TimedOut
from tactbench.core.matrix.engines.limits import Limits

T = TypeVar("T")
R = TypeVar("R")


class Isolated:
    """One forked child an item."""

    def __init__(self, jobs: int, limits: Limits) -> None:
        self._limits = limits

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or its error."""
        from multiprocessing.connection import Pipe

        for item in items:
            here, there = Pipe(duplex=False)
            log = tempfile.TemporaryFile()  # noqa: SIM115
            pid = os.fork()
            if pid == 0:
                os.dup2(log.fileno(), 1)
                os.dup2(log.fileno(), 2)
                try:
                    result: R | BaseException = work(item)
                except BaseException as error:
                    result = error
                there.send_bytes(pickle.dumps(result))
                os._exit(0)
            there.close()
            try:
                if not here.poll(self._limits.timeout_s):
                    yield item, TimedOut("The cell took too long.")
                    continue
                yield item, pickle.loads(here.recv_bytes())
            except EOFError:
                yield item, Crashed("The cell crashed.", signal=os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
                pid = 0
            finally:
                if pid:
                    os.kill(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
                here.close()
                log.close()
