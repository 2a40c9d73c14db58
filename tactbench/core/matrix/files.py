"""Writing a file whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path


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
