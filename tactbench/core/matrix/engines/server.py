"""The cell server: a process with one thread that forks a child for each cell it is asked for.

A process with threads must not fork: the child would inherit locks that nobody releases. It starts one of these
instead (see `cell_server`) and asks it over a pair of sockets. What several cells need, the server loads itself and
they inherit; but what a plugin brings, or a file, only after a child of its own has survived the same.
"""

from __future__ import annotations

import fcntl
import os
import pickle
import select
import signal
import sys
from collections.abc import Callable, Hashable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from tactbench.core.errors import EngineError
from tactbench.core.matrix.engines.company import keep_company
from tactbench.core.matrix.engines.request import Request, Setting, pack, pack_reply
from tactbench.core.matrix.engines.share import Share, shares_of
from tactbench.core.matrix.engines.sight import unseen
from tactbench.core.matrix.engines.surroundings import differences, sources_remembered, surroundings
from tactbench.core.matrix.pool.pool import Pool

IDLE_S = 600.0
"""A server that nobody has asked for so long ends: whoever started it may have forgotten it."""


class _Left(BaseException):
    """Whoever started this server has gone."""


def main(arguments: list[str]) -> None:
    """Serve over the socket with the file descriptor ``arguments[0]`` until its other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    channel: Connection[Any, Any] = Connection(int(arguments[0]))
    with suppress(_Left, EOFError, BrokenPipeError, ConnectionResetError):
        _end_with(channel)
        setting: Setting = pickle.loads(channel.recv_bytes())
        channel.send_bytes(pack(settle(setting)))
        serve(channel, setting)


def _end_with(channel: Connection[Any, Any]) -> None:
    """Raise `_Left` wherever this process is, once the other end of `channel` is closed.

    The kernel tells by SIGIO: while a child runs nobody here reads the channel.
    """
    watched = select.poll()
    watched.register(channel.fileno(), 0)  # POLLHUP is always told

    def look(number: int, frame: object) -> None:
        if watched.poll(0):
            signal.signal(signal.SIGIO, signal.SIG_IGN)
            raise _Left

    def leave(number: int, frame: object) -> None:
        raise _Left

    signal.signal(signal.SIGTERM, leave)
    signal.signal(signal.SIGIO, look)
    fcntl.fcntl(channel, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(channel, fcntl.F_SETFL, fcntl.fcntl(channel, fcntl.F_GETFL) | os.O_ASYNC)


def settle(setting: Setting) -> list[str]:
    """Go to the folder of `setting`; return what stands against computing here, one clause for each."""
    against = []
    try:
        os.chdir(setting.folder)
    except OSError as error:
        against.append(f"it cannot enter {setting.folder} ({error.strerror or error})")
    if setting.surroundings:
        from tactbench.core.plugins.registry import installed

        # A memory on another machine is not there, and costs half a second.
        sources = sources_remembered(setting.memory)
        against += differences(setting.surroundings, surroundings(installed(), sources))
    return against


def serve(channel: Connection[Any, Any], setting: Setting) -> None:
    """Answer requests one after the other; return when there are none for `IDLE_S`."""
    children = _Children(channel, setting)
    while channel.poll(IDLE_S):
        request: Request = pickle.loads(channel.recv_bytes())
        channel.send_bytes(pack_reply(_answer(children, request)))


def _answer(children: _Children, request: Request) -> Any:
    against = unseen(request.files)
    if against:
        return EngineError(
            f"{request.where} cannot compute this cell: {'; '.join(against)}.",
            hint="Every worker must see the files of the run, unchanged, at the same paths.",
        )
    for share in shares_of(request.work, request.item):
        children.inherit(share)

    def work(item: Any) -> Any:
        if request.company is not None:
            keep_company(request.company)
        return request.work(item)

    return children.one(work, request.item)


class _Children:
    """Forked processes, and what they inherit."""

    def __init__(self, channel: Connection[Any, Any], setting: Setting) -> None:
        self._channel = channel
        self._engine = Pool(1, setting.limits)
        self._tried: set[Hashable] = set()

    def one(self, work: Callable[[Any], Any], item: Any) -> Any:
        """Return what came of `item` in a child of its own."""

        def begun(item: Any) -> Any:
            self._channel.close()  # a child that outlives this server must not look like it
            signal.signal(signal.SIGIO, signal.SIG_DFL)
            return work(item)

        ((_, outcome),) = self._engine.each(begun, [item])
        return outcome

    def inherit(self, share: Share) -> None:
        """Load what is shared, once; what is not trusted only if a child survives it. Cells tell what is wrong."""
        if share.what in self._tried:
            return
        self._tried.add(share.what)
        if share.trusted or self.one(_survived, share) is True:
            with suppress(Exception):
                share.load()


def _survived(share: Share) -> bool:
    share.load()
    return True


if __name__ == "__main__":
    main(sys.argv[1:])
