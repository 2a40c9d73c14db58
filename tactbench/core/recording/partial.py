"""A recording while it is being made: a journal that can be read at every moment, also after ``kill -9``.

An HDF5 file cannot be that: between two flushes its chunks and their index disagree, and a process killed there leaves
a file of which the last chunks, or all of it, cannot be read; on a full disk its library cannot even close the file.
A journal is frames, one after the other, each with its length and checksum. Whatever happens, the frames before hold.
``docs/format.md`` describes it.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import FormatError, MissingRecordingError

MAGIC = b"tactbench-partial 1\n"
_FRAME = struct.Struct("<IQI")
"""Bytes of the head, bytes of the columns, CRC-32 of both."""
_DTYPES = {"<u1", "|u1", "<u2", "<i2", "<i4", "<i8", "<f4", "<f8"}

Columns = dict[str, npt.NDArray[Any]]
"""Columns of a stream by name: data (n, channels), t_ns (n,), quality (n, channels), sequence (n,)."""


class Partial:
    """The journal, for writing.

    Parameters
    ----------
    path
        Where it lies while the recording is being made; what a crash left there before is replaced.
    text
        The meta as it is known now.
    """

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.rows: dict[str, int] = {}
        """Rows of the streams that have had a block"""
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o666)
        try:
            _lock(self._file)
            os.ftruncate(self._file, 0)
            self._write(MAGIC + _frame(text.encode(), b""))
        except BaseException:
            os.close(self._file)
            raise

    def append(self, stream: str, columns: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add a block; once this returns, only the operating system's own crash can lose it."""
        plain = {name: np.ascontiguousarray(values, values.dtype.newbyteorder("<")) for name, values in columns.items()}
        shapes = [[name, values.dtype.str, list(values.shape)] for name, values in plain.items()]
        head = json.dumps([stream, shapes]).encode()
        self._write(_frame(head, b"".join(values.tobytes() for values in plain.values())))
        self.rows[stream] = self.rows.get(stream, 0) + len(columns["data"])

    def close(self) -> None:
        """Close the journal; it stays where it is."""
        os.close(self._file)

    def _write(self, frame: bytes) -> None:
        left = memoryview(frame)
        while left:
            left = left[os.write(self._file, left) :]


def read_partial(path: Path) -> tuple[str, Iterator[tuple[str, Columns]]]:
    """Return the meta text of a journal, and its blocks as far as they are whole.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is no journal, or broke off before it said what it is.
    """
    if not path.is_file():
        raise MissingRecordingError(f"There is no recording {path}.", hint="Check the path.")
    frames = _frames(path)
    first = next(frames, None)
    if first is None:
        raise FormatError(
            f"{path} is not an unfinished recording, or broke off at once.",
            hint="A finished one is read without `--salvage`.",
        )
    return first[0].decode(errors="replace"), _blocks(path, frames)


def _frame(head: bytes, body: bytes) -> bytes:
    return _FRAME.pack(len(head), len(body), zlib.crc32(body, zlib.crc32(head))) + head + body


def _frames(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Yield head and body of every whole frame; the first one that is not ends it."""
    left = path.stat().st_size - len(MAGIC)
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            return
        while left >= _FRAME.size:
            head_bytes, body_bytes, checksum = _FRAME.unpack(file.read(_FRAME.size))
            left -= _FRAME.size + head_bytes + body_bytes
            if left < 0:
                return
            head, body = file.read(head_bytes), file.read(body_bytes)
            if zlib.crc32(body, zlib.crc32(head)) != checksum:
                return
            yield head, body


def _blocks(path: Path, frames: Iterator[tuple[bytes, bytes]]) -> Iterator[tuple[str, Columns]]:
    for head, body in frames:
        try:
            stream, shapes = json.loads(head)
            columns: Columns = {}
            start = 0
            for name, dtype, shape in shapes:
                if dtype not in _DTYPES:
                    raise ValueError(f"a column of {dtype}")
                count = int(np.prod(shape, dtype=np.int64))
                flat = np.frombuffer(body, dtype=dtype, count=count, offset=start)
                columns[str(name)] = flat.reshape(shape)
                start += flat.nbytes
            yield str(stream), columns
        except (ValueError, TypeError, RecursionError) as error:
            raise FormatError(f"{path} holds a block that makes no sense: {error}.", hint="Record it again.") from error


def _lock(file: int) -> None:
    """Keep a second process from recording into the same file."""
    try:
        import fcntl
    except ImportError:  # Windows keeps others from an open file by itself
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise OSError(error.errno, "another process is recording into it") from error
    except OSError:
        pass  # some network disks know no locks
