"""Writing of whole files, locking of files, and texts that are not UTF-8."""

from __future__ import annotations

import os
import re
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tactbench.core.errors import UnwritableError


def utf8_json(text: str) -> str:
    r"""Return JSON with the lone surrogates in its texts escaped: an odd byte in a file name becomes ``\\udce9``."""
    return re.sub("[\ud800-\udfff]", lambda found: rf"\\u{ord(found[0]):04x}", text)


def named_file(text: str) -> Path:
    """Return the path of a file whose name may have been escaped by :func:`utf8_json`."""
    return Path(re.sub(r"\\u(dc[89a-f][0-9a-f])", lambda found: chr(int(found[1], 16)), text))


def try_lock(file: int) -> bool | None:
    """Lock an open file for this process (flock(2)) until the file is closed or the process ends.

    Return False if another process has the lock; None where locks are not supported: Windows, some network disks.
    """
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        return None
    return True


def hdf5_image(fill: Callable[[Any], None]) -> bytes:
    """Return the bytes of an HDF5 file that `fill`, called with the open ``h5py.File``, writes in memory.

    The HDF5 library cannot close a file on a full disk, and crashes the process if Python raises an error in a file
    to which it writes, as on Ctrl-C. The file has the oldest format of HDF5, which every reader opens.
    """
    import h5py

    name = uuid.uuid4().hex  # HDF5 takes two files in memory of one name for one
    # With the cache, rows may be appended in any number, and each chunk is compressed once.
    with h5py.File(
        name, "w", driver="core", backing_store=False, libver="earliest", rdcc_nbytes=2**26, rdcc_w0=1.0
    ) as file:
        fill(file)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def replace_file(
    path: Path,
    content: bytes,
    *,
    aside: Path | None = None,
    check: Callable[[Path], None] = lambda _aside: None,
    sync: bool = True,
) -> None:
    """Write `content` to a temporary file and rename it to `path`: readers see either the old or the new file.

    The temporary file is `aside`, in the same folder, or hidden (None), and is removed after an error. `check` is
    called with its path before the renaming; if `check` raises an error, no file is renamed. With `sync`, the disk has
    stored the file when the function returns. Raises OSError if the folder cannot be written.
    """
    aside = aside or path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with aside.open("wb") as file:
            file.write(content)
            file.flush()
            if sync:
                os.fsync(file.fileno())
        check(aside)
        aside.replace(path)
        if sync and os.name != "nt":  # folders cannot be opened there
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
    finally:
        aside.unlink(missing_ok=True)


@contextmanager
def writable(place: Path) -> Iterator[None]:
    """Return a context in which system errors while `place` is written are converted to UnwritableError."""
    try:
        yield
    except OSError as error:
        raise UnwritableError(
            f"{place} cannot be written: {error.strerror or error}.",
            hint="Check the folder's permissions and the free space, or give another folder with --out.",
        ) from error
