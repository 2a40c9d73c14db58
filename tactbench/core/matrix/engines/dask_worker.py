"""What runs inside a Dask worker: it passes requests on to its cell servers and never looks into them.

A worker has threads and must not fork, and what a cell imports, prints or breaks must not reach it.
"""

from __future__ import annotations

import atexit
from collections import deque
from collections.abc import Callable
from threading import Lock

from tactbench.core.errors import EngineError
from tactbench.core.matrix.engines.cell_server import CellServer, ServerEndedError, ended_twice
from tactbench.core.matrix.engines.request import Setting, pack_reply
from tactbench.core.matrix.engines.sight import unseen

_lock = Lock()
_idle: dict[str, list[CellServer]] = {}
_busy: dict[str, list[CellServer]] = {}
_over: deque[str] = deque(maxlen=100)
"""Sessions that have left: what of them is still at work must not start anything"""


def examine(setting: Setting, files: dict[str, str]) -> list[str]:
    """Return what stands against computing on this worker, one clause for each; its server stays for the cells."""
    try:
        server = _take(setting)
    except EngineError as error:
        return [error.message]
    against = server.against or unseen(files)
    _give_back(server)
    return against


def carry_out(setting: Setting, where: str, request: bytes) -> bytes:
    """Return the packed reply to a packed request; `where` names this worker for readers.

    A server that ends over a request is replaced once; the second time the cell has crashed. A cell that nobody waits
    for any more, because the run was killed, is ended.
    """
    wanted = _wanted()
    ended: ServerEndedError | None = None
    for _ in range(2):
        try:
            server = _take(setting)
        except EngineError as error:
            return pack_reply(EngineError(f"{where} cannot compute this cell: {error.message}"))
        try:
            if server.against:
                return pack_reply(EngineError(f"{where} cannot compute this cell: {'; '.join(server.against)}."))
            return server.ask(request, wanted)
        except ServerEndedError as error:
            ended = error
            server.close()
            if not wanted():
                break
        finally:
            _give_back(server)
    assert ended is not None
    return pack_reply(ended_twice(ended, f" for {where}"))


def leave(session: str) -> None:
    """End the servers of `session`, and with them the cells that are still at work."""
    with _lock:
        _over.append(session)
        idle, busy = _idle.pop(session, []), _busy.pop(session, [])
    for server in busy:
        server.terminate()
    for server in idle:
        server.close()


def _wanted() -> Callable[[], bool]:
    """Return what tells whether the task that this thread carries out is still wanted by anybody."""
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()

    def wanted() -> bool:
        task = worker.state.tasks.get(key)
        return task is not None and task.state != "cancelled"

    return wanted


@atexit.register
def _leave_all() -> None:
    for session in {*_idle, *_busy}:
        leave(session)


def _take(setting: Setting) -> CellServer:
    with _lock:
        if setting.session in _over:
            raise EngineError("the run that asked for it has ended")
        idle = _idle.setdefault(setting.session, [])
        while idle:
            server = idle.pop()
            if server.alive:
                _busy.setdefault(setting.session, []).append(server)
                return server
            server.close()
    server = CellServer(setting)
    with _lock:
        _busy.setdefault(setting.session, []).append(server)
    return server


def _give_back(server: CellServer) -> None:
    session = server.setting.session
    with _lock:
        busy = _busy.get(session, [])
        ours = server in busy
        if ours:
            busy.remove(server)
            if server.alive:
                _idle.setdefault(session, []).append(server)
    if not ours:
        server.close()
