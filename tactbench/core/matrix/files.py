"""Writing a file whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path


def replace_file(path: Path, content: bytes, *, sync: bool = True, mode: int = 0o666) -> None:
    """Write `content` aside, sync it and rename it to `path`: a reader sees the old file or the new one.

    A file that holds it already is left alone: syncing takes milliseconds, and a run in which nothing is new has none.

    Parameters
    ----------
    path
        The file.
    content
        What it is to hold.
    sync
        Whether it must survive a power cut, and not only the end of this process.
    mode
        Who may do what with a new file, before the process's mask.

    Raises
    ------
    OSError
        If the folder cannot be written; nothing is left behind.
    """
    if content and _holds(path, content):
        return
    aside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with open(aside, "wb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
            file.write(content)
            if sync:
                file.flush()
                os.fsync(file.fileno())
        aside.replace(path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise


def _holds(path: Path, content: bytes) -> bool:
    try:
        return path.stat().st_size == len(content) and path.read_bytes() == content
    except OSError:
        return False
