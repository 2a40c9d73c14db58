"""One run at a time in a result folder: held by the kernel, which lets go however the run ends."""

from __future__ import annotations

import errno
import json
import os
import platform
import time
from contextlib import suppress
from pathlib import Path

from tactbench.core.errors import FolderError
from tactbench.core.matrix.files import replace_file
from tactbench.core.matrix.store.disk import sync_folder
from tactbench.core.matrix.store.leftovers import alive

_FORK_S = 5.0
"""How long a process that was being forked when its run was killed may take to let go: it does so before all else."""

_HELD: set[int] = set()
"""Descriptors that a child must let go: else an orphaned worker would hold the folder after its run was killed."""


def _let_go_in_child() -> None:
    for descriptor in _HELD:
        with suppress(OSError):
            os.close(descriptor)
    _HELD.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go_in_child)


class Lock:
    """The lock on one folder; taken when made.

    Parameters
    ----------
    folder
        A folder that exists and may be written.

    Raises
    ------
    FolderError
        If another run holds it; the message says who.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._process = os.getpid()
        self.works = True
        """False where the file system knows no locks."""
        self._note = folder / "cache" / "held.json"
        self.broke_off = False
        """Whether the last run here was killed, or the power was cut: it did not tidy up."""
        self._descriptor = os.open(folder, os.O_RDONLY)
        try:
            self.works = self._taken()
        except BlockingIOError as error:
            os.close(self._descriptor)
            raise FolderError(
                f"Another run is at work in {folder}: {self._holder()}.",
                hint="Wait until it ends, or give another folder with --out DIR.",
            ) from error
        _HELD.add(self._descriptor)
        self.broke_off = self._note.exists()
        # For people only: nothing is decided by this clock.
        since = time.strftime("%Y-%m-%d %H:%M:%S %z")
        about = {"pid": os.getpid(), "host": platform.node(), "since": since}
        try:
            replace_file(self._note, json.dumps(about).encode())
            sync_folder(self._note.parent)
        except BaseException:
            self._close()
            raise

    def _taken(self) -> bool:
        """Lock the folder; False where there are no locks, BlockingIOError where another run has it.

        A process that was forked just before its run was killed still holds its copy of the lock until it first runs.
        """
        ends = time.monotonic() + _FORK_S
        while True:
            try:
                return _flock(self._descriptor)
            except BlockingIOError:
                if time.monotonic() > ends or not self._holder_ended():
                    raise
            time.sleep(0.01)

    def _holder_ended(self) -> bool:
        """Return whether the run that holds the folder was one of this host, and its process is no more."""
        found = self._noted()
        return found is not None and found[1] == platform.node() and not alive(str(found[0]))

    def in_place(self) -> bool:
        """Return whether the folder still lies where it lay."""
        try:
            now, then = self.folder.stat(), os.fstat(self._descriptor)
        except OSError:
            return False
        return (now.st_dev, now.st_ino) == (then.st_dev, then.st_ino)

    def release(self) -> None:
        """Let go; who held it is forgotten."""
        if self._process == os.getpid():  # not in a child, whose copy of this is none
            with suppress(OSError):
                self._note.unlink(missing_ok=True)
        self._close()

    def _close(self) -> None:
        if self._descriptor in _HELD:
            _HELD.discard(self._descriptor)
            os.close(self._descriptor)

    def _holder(self) -> str:
        found = self._noted()
        if found is None:
            return "it has not said which"
        pid, host, since = found
        return f"process {pid} on {host[:100]!r} since {since[:40]}"

    def _noted(self) -> tuple[int, str, str] | None:
        """Return process, host and beginning of the run that holds the folder, as it wrote them down."""
        try:
            with self._note.open("rb") as file:
                said = json.loads(file.read(4096))
            return int(said["pid"]), str(said["host"]), str(said["since"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None


def _flock(descriptor: int) -> bool:
    """Lock a descriptor; False where there are no locks, BlockingIOError where another has it."""
    try:
        import fcntl
    except ImportError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError as error:
        if error.errno in (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EBADF, errno.EINVAL):
            return False  # some network disks
        raise
    return True
