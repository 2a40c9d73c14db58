"""Writing of whole files, locks, and texts that are not UTF-8."""

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
    r"""Return JSON whose texts have their lone surrogates escaped: a byte of a file name becomes ``\\udce9``."""
    return re.sub("[\ud800-\udfff]", lambda found: rf"\\u{ord(found[0]):04x}", text)


def named_file(text: str) -> Path:
    """Return the path of a file whose name :func:`utf8_json` may have escaped."""
    return Path(re.sub(r"\\u(dc[89a-f][0-9a-f])", lambda found: chr(int(found[1], 16)), text))


def try_lock(file: int) -> bool | None:
    """Lock an open file for this process (flock(2)) until it is closed or the process ends.

    Return False if another process has the lock; None where there are no locks: on Windows, on some network disks.
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
    """Return the bytes of an HDF5 file that is built in memory by `fill`, which is called with the open ``h5py.File``.

    The HDF5 library cannot close a file on a full disk, and crashes the process when Python raises in a file object
    that it writes through, as Ctrl-C does. The file has the oldest format of HDF5, which every reader opens.
    """
    import h5py

    name = uuid.uuid4().hex  # HDF5 takes two files in memory of one name for one
    with h5py.File(name, "w", driver="core", backing_store=False, libver="earliest") as file:
        fill(file)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def replace_file(path: Path, content: bytes) -> None:
    """Write `content` aside, sync it and rename it to `path`: a reader sees the old file or the new one.

    Raises OSError if the folder cannot be written; no partial file is left then.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with aside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        aside.replace(path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise


@contextmanager
def writable(place: Path) -> Iterator[None]:
    """Return a context that turns errors of the system while `place` is written into UnwritableError."""
    try:
        yield
    except OSError as error:
        raise UnwritableError(
            f"{place} cannot be written: {error.strerror or error}.",
            hint="Check the folder's permissions and the free space, or give another with --out.",
        ) from error
