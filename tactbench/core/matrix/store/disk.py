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
_GONE = {errno.ENOENT, errno.ESTALE}
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


def refusal(folder: Path, error: OSError) -> FolderError:
    """Return the error to raise when the system refuses to write into a result folder."""
    number = error.errno or 0
    if number in _FULL:
        return FolderError(
            f"The folder {folder} cannot be written: {_FULL[number]}.",
            hint=f"{KEPT}: make room, and the same command goes on from there.",
        )
    if number in _GONE:
        return FolderError(
            f"The folder {folder} was removed or moved while it was being written.",
            hint="What was finished before lies where it was moved to; run the same command again, or with its new "
            "place as --out DIR.",
        )
    return FolderError(
        f"The folder {folder} cannot be written: {error.strerror or error}.",
        hint=f"{KEPT}: check its permissions, or give another one with --out DIR.",
    )


def sync_path(path: Path) -> None:
    """Have a file, or the names in a folder, survive a power cut, where the system can sync that."""
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(opened)
