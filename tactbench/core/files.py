"""Writing a file whole or not at all, reading one that anybody may have put there, locks, and digests."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from pathlib import Path


def read_regular(path: Path, most: int, *, follow: bool = True) -> bytes:
    """Return the first `most` + 1 bytes of a file.

    Parameters
    ----------
    most
        What the caller takes; one byte more says that the file is larger.
    follow
        Whether the last part of the path may be a link.

    Raises
    ------
    OSError
        If it cannot be read, or is a pipe, a device or a folder: opening a pipe would wait for its other end.
    """
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    opened = os.open(path, flags if follow else flags | getattr(os, "O_NOFOLLOW", 0))
    with open(opened, "rb") as file:  # noqa: PTH123  (a descriptor)
        if not stat.S_ISREG(os.fstat(opened).st_mode):
            raise OSError(errno.EINVAL, "it is no regular file", str(path))
        return file.read(most + 1)


def sha256(content: str | bytes) -> str:
    """Return the SHA-256 of bytes or of a text, 64 hexadecimal digits."""
    if isinstance(content, str):
        content = content.encode("utf-8", "surrogatepass")  # half characters, as a name of a file may hold, too
    return hashlib.sha256(content).hexdigest()


def try_lock(file: int) -> bool | None:
    """Lock an open file for this process (flock(2)); the kernel lets go when it is closed, however the process ends.

    Returns
    -------
    bool or None
        False if another process has it; None where there are no locks: on Windows, on some network disks.
    """
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        return None
    return True


def replace_file(path: Path, content: bytes, *, sync: bool = True) -> None:
    """Write `content` aside, sync it and rename it to `path`: a reader sees the old file or the new one.

    Parameters
    ----------
    path
        The file.
    content
        What it is to hold.
    sync
        Whether it must survive a power cut, and not only the end of this process.

    Raises
    ------
    OSError
        If the folder cannot be written; nothing is left behind.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        write_file(aside, content, sync=sync)
        aside.replace(path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise


def write_file(path: Path, content: bytes, *, sync: bool) -> None:
    """Write a file anew; raises OSError if not all of it could be written.

    `sync` says whether it must survive a power cut.
    """
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o666)
    try:
        write_all(file, content)
        if sync:
            os.fsync(file)
    finally:
        os.close(file)


def write_all(file: int, content: bytes) -> None:
    """Write all of `content`: one call takes two gigabytes at most, and on a full disk the next one says why."""
    written = os.write(file, content)
    while written < len(content):
        written += os.write(file, content[written:])
