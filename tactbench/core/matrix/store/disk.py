"""Words for what a disk refuses."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tactbench.core.errors import FolderError

_FULL = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the quota is used up",
    errno.EFBIG: "a file would be larger than this process may write",
}
_GONE = {errno.ENOENT, errno.ESTALE, errno.ENOTDIR}
KEPT = "What was finished before is kept"


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Turn what the system refuses while `folder` is written into an error that says what to do.

    Raises
    ------
    FolderError
        In place of an OSError.
    """
    try:
        yield
    except OSError as error:
        raise refusal(folder, error) from error


def refusal(folder: Path, error: OSError, *, begun: bool = True) -> FolderError:
    """Return the error to raise when the system refuses to write into a result folder.

    Parameters
    ----------
    begun
        Whether it could be written before.
    """
    number = error.errno or 0
    if number in _FULL:
        return FolderError(
            f"The folder {folder} cannot be written: {_FULL[number]}.",
            hint=f"{KEPT}: make room, and the same command goes on from there.",
        )
    if begun and number in _GONE:
        return removed(folder)
    return FolderError(
        f"The folder {folder} cannot be written: {error.strerror or error}.",
        hint=f"{KEPT}: check its permissions, or give another one with --out DIR.",
    )


def removed(folder: Path) -> FolderError:
    """Return the error to raise when a folder is not where it was."""
    return FolderError(
        f"The folder {folder} was removed or moved while it was being written.",
        hint="What was finished before lies where it was moved to; run the same command again, or with its new place "
        "as --out DIR.",
    )


def sync_all(folder: Path) -> None:
    """Make everything that was written to the disk of `folder` survive a power cut: dear once, cheap for many files."""
    opened = os.open(folder, os.O_RDONLY)
    try:
        if _syncfs(opened):
            os.sync()
    finally:
        os.close(opened)


def _syncfs(descriptor: int) -> int:
    """Sync the one file system that a descriptor lies on; not 0 where that cannot be done."""
    import ctypes

    try:
        failed: int = ctypes.CDLL(None).syncfs(descriptor)
    except (AttributeError, OSError, TypeError):  # neither Linux nor a libc that is known
        return -1
    return failed


def sync_folder(folder: Path) -> None:
    """Make what was renamed into `folder` survive a power cut; a system that cannot is not asked twice."""
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(opened)
