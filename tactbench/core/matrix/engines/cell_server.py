"""Starting and asking a cell server."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing.connection import Pipe

from tactbench.core.errors import Crashed, EngineError
from tactbench.core.matrix.engines.request import Setting, pack

PATIENCE_S = 60.0
"""How long a server may take to start; and to answer after the time that its children may take."""
_CHILDREN = 3
"""Children that one request may need: two that try what is shared, and the cell."""
LOOK_S = 1.0
"""How often a silent server is looked at: a grandchild of it may hold its end of the channel open."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class ServerEndedError(EngineError):
    """A cell server ended or fell silent while it was asked."""

    def __init__(self, message: str, *, hint: str = "", signal: int | None = None) -> None:
        super().__init__(message, hint=hint)
        self.signal = signal


def thread_bounds() -> Mapping[str, str]:
    """Return how many threads numerical libraries may use here."""
    return {name: os.environ[name] for name in _THREADS if name in os.environ}


class CellServer:
    """A process that answers one request after the other, each in a forked child.

    Parameters
    ----------
    setting
        What is the same for all requests.

    Raises
    ------
    ServerEndedError
        If it does not start.
    """

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.channel, theirs = Pipe()
        # Its own words are kept for the case that it does not start; what cells print is caught cell by cell.
        self._words = tempfile.TemporaryFile()  # noqa: SIM115  (closed by `close`)
        path = os.pathsep.join(entry for entry in sys.path if entry)
        try:
            with theirs:
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "tactbench.core.matrix.engines.server", str(theirs.fileno())],
                    pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._words,
                    env={**os.environ, **setting.threads, "PYTHONPATH": path}, start_new_session=True,
                )  # fmt: skip
        except OSError as error:
            self.channel.close()
            self._words.close()
            raise ServerEndedError(f"A cell server cannot be started: {error.strerror or error}.") from error
        self.against: list[str] = []
        """What stands against computing there, one clause for each"""
        try:
            self.channel.send_bytes(pack(setting))
            self.against += map(str, pickle.loads(self._hear(PATIENCE_S)))
        except BaseException:
            self.close()
            raise

    @property
    def alive(self) -> bool:
        """Whether it can be asked."""
        return self._process.poll() is None and not self.channel.closed

    def ask(self, request: bytes, wanted: Callable[[], bool] = lambda: True) -> bytes:
        """Return the packed reply to a packed request.

        Parameters
        ----------
        request
            A packed `Request`.
        wanted
            Asked now and then whether anybody still waits for the reply.

        Raises
        ------
        ServerEndedError
            If the server ended, or did not answer in the time that its children may take and `PATIENCE_S`, or
            nobody waits for it any more.
        """
        bound = self.setting.limits.timeout_s
        try:
            self.channel.send_bytes(request)
        except OSError as error:
            raise self._ended() from error
        return self._hear(None if bound is None else _CHILDREN * bound + PATIENCE_S, wanted)

    def hear(self) -> bytes:
        """Return the packed reply that is waiting; raises like `ask`."""
        return self._hear(PATIENCE_S)

    def _hear(self, seconds: float | None, wanted: Callable[[], bool] = lambda: True) -> bytes:
        waited = 0.0
        try:
            while not self.channel.poll(LOOK_S):
                waited += LOOK_S
                if self._process.poll() is not None and not self.channel.poll(0):
                    raise self._ended()
                if not wanted():
                    raise ServerEndedError("Nobody waits for the cell any more.")
                if seconds is not None and waited >= seconds:
                    raise ServerEndedError(f"A cell server did not answer for {waited:.0f} s.")
            return self.channel.recv_bytes()
        except (EOFError, OSError) as error:
            raise self._ended() from error

    def _ended(self) -> ServerEndedError:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LOOK_S)
        code = self._process.poll()
        how = f"by signal {-code}" if code is not None and code < 0 else f"with exit code {code}"
        words = "" if self._words.closed else self._last_words()
        return ServerEndedError(
            f"A cell server ended {how}{': ' if words else '.'}{words}", signal=-code if code and code < 0 else None
        )

    def _last_words(self) -> str:
        size = self._words.seek(0, os.SEEK_END)
        self._words.seek(max(size - 2000, 0))
        lines = self._words.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    def terminate(self) -> None:
        """Have it end, and the child it may have, while another thread of this process asks it."""
        self._process.terminate()

    def close(self) -> None:
        """End it, and the child it may have."""
        self.channel.close()  # it hears of this, ends its child and goes
        try:
            self._process.wait(2 * LOOK_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._words.close()


def ended_twice(error: ServerEndedError, where: str = "") -> Crashed:
    """Return what a cell is told to have done that ended two servers."""
    return Crashed(
        f"The process that forks cells{where} ended twice over this one. {error.message}",
        hint="The cell, or a plugin it loads, ends its parent process.", signal=error.signal,
    )  # fmt: skip
