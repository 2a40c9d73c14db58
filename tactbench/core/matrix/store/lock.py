"""One run at a time in a result folder: a record lock, which goes with its process and which no child inherits."""

from __future__ import annotations

import errno
import json
import os
import platform
import time
from contextlib import suppress
from pathlib import Path

from tactbench.core.errors import FolderError
from tactbench.core.files import replace_file

_held: set[tuple[int, int]] = set()
"""Folders that this process holds, by device and inode: a record lock keeps other processes out, not its own."""


class Lock:
    """The lock on one folder; taken when made.

    Parameters
    ----------
    folder
        A folder that exists and may be written, with a folder ``cache``.

    Raises
    ------
    FolderError
        If another run holds it; the message says which.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._holder = folder / "cache" / "held.json"
        """For people only: nothing is decided by what it says."""
        self._place = _place(folder)
        if self._place in _held:
            raise self._refusal()
        self._descriptor = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _locked(self._descriptor):
                raise self._refusal()
            since = time.strftime("%Y-%m-%d %H:%M:%S %z")
            about = {"pid": os.getpid(), "host": platform.node(), "since": since}
            replace_file(self._holder, json.dumps(about).encode(), sync=False)
        except BaseException:
            os.close(self._descriptor)
            raise
        _held.add(self._place)

    def in_place(self) -> bool:
        """Return whether the folder still lies where it lay."""
        try:
            return _place(self._folder) == self._place
        except OSError:
            return False

    def release(self) -> None:
        """Let other runs in."""
        with suppress(OSError):
            self._holder.unlink(missing_ok=True)
        _held.discard(self._place)
        os.close(self._descriptor)

    def _refusal(self) -> FolderError:
        try:
            with self._holder.open("rb") as file:
                found = json.loads(file.read(4096))
            which = f"process {int(found['pid'])} on {str(found['host'])[:100]!r} since {str(found['since'])[:40]}"
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            which = "it has not said which"
        return FolderError(
            f"Another run is at work in {self._folder}: {which}.",
            hint="Wait until it ends, or give another folder with --out DIR.",
        )


def _place(folder: Path) -> tuple[int, int]:
    stat = folder.stat()
    return stat.st_dev, stat.st_ino


def _locked(descriptor: int) -> bool:
    """Lock a file; False if another process has it. Where there are no locks, nobody is kept out."""
    try:
        import fcntl

        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:
        return True
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN):
            return False
        if error.errno not in (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EINVAL):  # some network disks
            raise
    return True
