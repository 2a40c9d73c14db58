"""Journal of a recording that is being made, which can be read at every moment, also after ``kill -9``; its rescue.

An HDF5 file cannot be that: between two flushes its chunks and their index disagree, and a process killed there leaves
a file of which the last chunks, or all of it, cannot be read.
A journal is the line ``tactbench-partial 2`` and frames, one after the other. Whatever happens, the frames before hold.
A frame is a head of 16 bytes, little-endian (uint32 length of the JSON, uint64 length of the body, uint32 CRC-32 of
both), the JSON, the body. The first frame's JSON is the meta, without body; every other one is

- ``[stream, [[column, type, shape], ...]]``: a block, whose body is its columns, little-endian, in that order;
- ``{"meta": {field: value, ...}}``: fields that replace those of the meta, without body.

``tactbench-partial 1``, which has only blocks, without ``device_ns``, is read.
"""

from __future__ import annotations

import itertools
import json
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.errors import FormatError, MissingRecordingError
from tactbench.core.files import try_lock
from tactbench.core.recording import image
from tactbench.core.recording.clock_fit import with_clock_fits
from tactbench.core.recording.format import (
    PARTIAL,
    Array,
    Blocks,
    Columns,
    canonical,
    completing_path,
    meta_text,
    readable,
)
from tactbench.core.recording.reader import Recording, parse_meta
from tactbench.core.spec.recording import RecordingMeta

MAGIC = b"tactbench-partial 2\n"
_READ = (b"tactbench-partial 1\n", MAGIC)
_FRAME = struct.Struct("<IQI")
"""Head of a frame: length of its JSON, length of its body, CRC-32 of both."""

REMARK = "Rescued: the recording broke off and is not whole."


class Partial:
    """The journal of one attempt to make a recording, for writing; no other attempt has the same file.

    Parameters
    ----------
    path
        Where the recording is to lie.
    text
        The meta as it is known now.
    """

    def __init__(self, path: Path, text: str) -> None:
        self.rows: dict[str, int] = {}
        """Number of rows of each stream that has had a block."""
        self._end = 0
        for attempt in itertools.count(1):  # x.h5.partial, x.h5.2.partial and so on
            self.path = path.with_name(f"{path.name}{'' if attempt == 1 else f'.{attempt}'}{PARTIAL}")
            try:
                self._file = os.open(
                    self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666
                )
                break
            except FileExistsError:
                continue
        try_lock(self._file)  # marks it as being written
        try:
            self._write(MAGIC + _frame(text.encode(), b""))
        except BaseException:
            self.close()
            self.path.unlink()
            raise

    def append(self, stream: str, columns: Mapping[str, Array]) -> None:
        """Add a block; once this returns, only a crash of the operating system can lose it."""
        plain = {name: np.ascontiguousarray(values, values.dtype.newbyteorder("<")) for name, values in columns.items()}
        shapes = [[name, values.dtype.str, list(values.shape)] for name, values in plain.items()]
        head = json.dumps([stream, shapes]).encode()
        self._write(_frame(head, b"".join(values.tobytes() for values in plain.values())))
        self.rows[stream] = self.rows.get(stream, 0) + len(columns["data"])

    def revise(self, changes: Mapping[str, Any]) -> None:
        """Add fields that replace those of the meta, as plain data; raises ValueError for NaN and infinity."""
        self._write(_frame(json.dumps({"meta": changes}, allow_nan=False).encode(), b""))

    def close(self) -> None:
        """Close the journal and leave it where it is."""
        os.close(self._file)

    def _write(self, frame: bytes) -> None:
        left = memoryview(frame)
        try:
            while left:
                left = left[os.write(self._file, left) :]
            self._end += len(frame)
        except BaseException:
            # After Ctrl-C, or on a full disk, only whole frames remain.
            os.ftruncate(self._file, self._end)
            os.lseek(self._file, self._end, os.SEEK_SET)
            raise


@dataclass(frozen=True)
class _Journal:
    """Content of a journal when it was read; it may have grown since."""

    path: Path
    meta: RecordingMeta
    """The latest meta."""
    end: int
    """Length of the whole frames [bytes]."""

    def blocks(self) -> Blocks:
        """Yield the stream and the columns of each block."""
        return read_blocks(self.path, self.end)

    def fitted(self, **changes: Any) -> RecordingMeta:
        """Return the meta with changes, and with clock fits and counts of rows from the blocks."""
        rows: Counter[str] = Counter()

        def counted() -> Blocks:
            for stream, columns in self.blocks():
                rows[stream] += len(columns["data"])
                yield stream, columns

        fitted = with_clock_fits(self.meta.model_copy(update=changes), counted())
        streams = {name: counts.model_copy(update={"written": rows[name]}) for name, counts in fitted.streams.items()}
        return fitted.model_copy(update={"streams": streams})


def salvage(path: Path) -> Recording:
    """Open an unfinished recording (``….partial``), in which every block can be read that had been written.

    It may still be growing: the recording has the blocks of this moment.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not an unfinished recording.
    """
    import h5py

    journal = _read(path)
    meta = journal.fitted()
    file = image.build(meta, journal.blocks(), {}, complete=False)
    recording = Recording(path, h5py.File(h5py.h5f.open_file_image(file)), meta_text(meta), complete=False)
    recording.verify()
    return recording


def rescue(path: Path, target: Path) -> None:
    """Convert an unfinished recording into a finished one at `target`, excluded from evaluations since it broke off.

    The unfinished one stays where it is.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not an unfinished recording.
    RecordingError
        If `target` exists, or cannot be written.
    """
    image.require_free(target)
    journal = _read(path)
    excluded = journal.meta.excluded or "interrupted: it broke off, and was rescued"
    meta = journal.fitted(remarks=(*journal.meta.remarks, REMARK), excluded=excluded)
    image.store(target, meta, journal.blocks(), {}, aside=completing_path(target))


def _read(path: Path) -> _Journal:
    """Return the content of a journal, as far as its frames are whole; raises as :func:`salvage`."""
    if not path.is_file():
        raise MissingRecordingError(f"There is no recording {path}.", hint="Check the path.")
    frames = _frames(path, path.stat().st_size)
    text, _, end = next(frames, (b"", b"", 0))
    if not end:
        raise FormatError(
            f"{path} is not an unfinished recording, or broke off at once.",
            hint="A finished one is read without `--salvage`.",
        )
    with readable(path):
        content = json.loads(text)
        for head, _, place in frames:
            end, frame = place, json.loads(head)
            if "meta" in frame:
                content.update(frame["meta"])
        return _Journal(path, parse_meta(path, canonical(content)), end)


def read_blocks(path: Path, end: int | None = None) -> Blocks:
    """Yield the blocks in the first `end` bytes of a journal; raises FormatError for one that makes no sense."""
    frames = _frames(path, path.stat().st_size if end is None else end)
    next(frames, None)
    for head, body, _ in frames:
        if not head.startswith(b"{"):
            with readable(path):
                block = _block(json.loads(head), body)
            yield block


def _frame(head: bytes, body: bytes) -> bytes:
    return _FRAME.pack(len(head), len(body), zlib.crc32(body, zlib.crc32(head))) + head + body


def _frames(path: Path, end: int) -> Iterator[tuple[bytes, bytes, int]]:
    """Yield the head, the body and the end of every frame, up to the first that is not whole."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) not in _READ:
            return
        place = len(MAGIC)
        while place + _FRAME.size <= end:
            head_bytes, body_bytes, checksum = _FRAME.unpack(file.read(_FRAME.size))
            place += _FRAME.size + head_bytes + body_bytes
            if place > end:
                return
            head, body = file.read(head_bytes), file.read(body_bytes)
            if zlib.crc32(body, zlib.crc32(head)) != checksum:
                return
            yield head, body, place


def _block(head: Any, body: bytes) -> tuple[str, Columns]:
    stream, shapes = head
    columns: Columns = {}
    start = 0
    for name, dtype, shape in shapes:
        count = int(np.prod(shape, dtype=np.int64))
        flat = np.frombuffer(body, dtype=dtype, count=count, offset=start)
        columns[str(name)] = flat.reshape(shape)
        start += flat.nbytes
    return str(stream), columns
