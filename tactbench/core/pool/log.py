"""What an item of work prints, at Python's level and below it, kept apart from our own output."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from typing import TextIO

from tactbench.core.pool.processes import c_library

LOG_BYTES = 64 * 2**10
"""Of what a cell prints, so much is kept: the last."""
OVERFLOW_BYTES = 2**20
"""A log is cut back once it is longer: whoever prints without end must not fill memory."""

_KEEP_SIZE_AND_PUNCH_HOLE = 0x01 | 0x02
_Offset = ctypes.c_longlong

_open_logs: list[int] = []
"""Descriptors of the logs being written in this process, innermost last."""


def open_log() -> int:
    """Return the descriptor of an empty log without a name; what is written goes to its end."""
    if hasattr(os, "memfd_create"):
        log = os.memfd_create("log")
    else:
        with tempfile.TemporaryFile() as file:
            log = os.dup(file.fileno())
    if sys.platform != "win32":
        import fcntl

        fcntl.fcntl(log, fcntl.F_SETFL, fcntl.fcntl(log, fcntl.F_GETFL) | os.O_APPEND)
    return log


def tail(log: int) -> str:
    """Return the end of a log as text; bytes that are no text are replaced."""
    length = os.fstat(log).st_size
    found = os.pread(log, LOG_BYTES, max(0, length - LOG_BYTES))
    return found.decode("utf-8", errors="replace")


def cut_back(log: int) -> None:
    """Give back the memory of all but the end of a log that has grown too long.

    Its process may write and read it meanwhile: the end stays where it is, and a hole takes the place of what was
    before (fallocate(2)). Where there are no holes the log is written anew, and for a moment it is empty.
    """
    status = os.fstat(log)
    if 512 * status.st_blocks <= OVERFLOW_BYTES:
        return
    before = status.st_size - LOG_BYTES
    with suppress(AttributeError):
        if before > 0 and not c_library().fallocate(log, _KEEP_SIZE_AND_PUNCH_HOLE, _Offset(0), _Offset(before)):
            return
    kept = os.pread(log, LOG_BYTES, max(0, before))
    os.ftruncate(log, 0)
    os.write(log, kept)


def flush() -> None:
    """Write out what this process's streams still hold, those of its C library included."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()
    with suppress(Exception):
        c_library().fflush(None)


def printed() -> str:
    """Return what the item of work that this process is busy with has printed so far; "" outside of one."""
    if not _open_logs:
        return ""
    flush()
    return tail(_open_logs[-1])


def print_to(log: int) -> None:
    """Let this process print to `log` for the rest of its life, and read nothing."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(log, 1)
    os.dup2(log, 2)
    sys.stdin = open(0, closefd=False)  # noqa: SIM115  (a descriptor, for good)
    sys.stdout = sys.__stdout__ = _stream(1)  # type: ignore[misc,assignment]
    sys.stderr = sys.__stderr__ = _stream(2)  # type: ignore[misc,assignment]
    _open_logs[:] = [log]


@contextmanager
def printing_to(log: int) -> Iterator[None]:
    """Let this process print to `log` while the context lasts."""
    flush()
    before: tuple[TextIO, TextIO] = (sys.stdout, sys.stderr)
    saved = [os.dup(1), os.dup(2)]
    os.dup2(log, 1)
    os.dup2(log, 2)
    sys.stdout, sys.stderr = _stream(1), _stream(2)
    _open_logs.append(log)
    try:
        yield
    finally:
        flush()
        _open_logs.remove(log)
        sys.stdout, sys.stderr = before
        for number, descriptor in enumerate(saved, 1):
            os.dup2(descriptor, number)
            os.close(descriptor)


def _stream(number: int) -> TextIO:
    raw = open(number, "wb", buffering=0, closefd=False)  # noqa: SIM115  (closed with its wrapper)
    return TextIOWrapper(raw, encoding="utf-8", errors="backslashreplace", write_through=True)
