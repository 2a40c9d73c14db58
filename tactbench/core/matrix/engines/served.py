"""An engine for a process that has threads and must not fork: it asks cell servers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from tactbench.core.matrix.engines.cell_server import LOOK_S, CellServer, ServerEndedError, ended_twice, thread_bounds
from tactbench.core.matrix.engines.engine import R, T
from tactbench.core.matrix.engines.limits import Limits
from tactbench.core.matrix.engines.request import Request, Setting, pack, unpack_reply


class Served:
    """An engine for a process with threads on one machine: `jobs` cell servers.

    Parameters
    ----------
    jobs
        Cells at once.
    limits
        What a cell may take.
    """

    def __init__(self, jobs: int, limits: Limits) -> None:
        self._jobs = jobs
        self._setting = Setting("served", str(Path.cwd()), limits, threads=thread_bounds())

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or its exception, in the order in which they end."""
        waiting = deque((item, 0) for item in items)
        idle: list[CellServer] = []
        busy: dict[Connection[Any, Any], tuple[CellServer, T, int]] = {}
        try:
            while waiting or busy:
                while waiting and len(busy) < self._jobs:
                    item, ended = waiting.popleft()
                    server = idle.pop() if idle else CellServer(self._setting)
                    busy[server.channel] = server, item, ended
                    server.channel.send_bytes(pack(Request(work, item)))
                if meanwhile is not None:
                    meanwhile()
                    meanwhile = None
                heard = wait(list(busy), LOOK_S)
                for channel in [one for one, (server, *_) in busy.items() if one in heard or not server.alive]:
                    server, item, ended = busy.pop(channel)
                    try:
                        outcome = unpack_reply(server.hear()).outcome
                        idle.append(server)
                    except ServerEndedError as error:
                        server.close()
                        if not ended:
                            waiting.append((item, 1))
                            continue
                        outcome = ended_twice(error)
                    yield item, outcome
        finally:
            for server in (*idle, *(server for server, _, _ in busy.values())):
                server.close()
