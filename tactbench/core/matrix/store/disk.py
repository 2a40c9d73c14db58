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
_MISSING = {errno.ENOENT, errno.ESTALE}


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
        kept = "What was finished before is kept"
        what = f"cannot be written: {_FULL.get(error.errno or 0) or error.strerror or error}"
        hint = f"{kept}: check its permissions, or give another one with --out DIR."
        if error.errno in _FULL:
            hint = f"{kept}: make room, and the same command goes on from there."
        elif error.errno in _MISSING:
            what = "was removed or moved while it was being written"
            hint = "What was finished before lies where it was moved to; run the same command again, or with its new "
            hint += "place as --out DIR."
        raise FolderError(f"The folder {folder} {what}.", hint=hint) from error


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
