"""Journal of an unfinished recording, readable at every moment, also after ``kill -9``; its conversion to a recording.

An HDF5 file would not do: between two flushes its chunks and their index disagree, and a process killed then leaves a
file whose last chunks, or all chunks, cannot be read.
A journal is the line ``tactbench-partial 2`` followed by frames. Whatever happens, complete frames stay readable.
A frame is a head of 16 bytes, little-endian (uint32 length of the JSON, uint64 length of the body, uint32 CRC-32 of
both), the JSON, the body. The first frame's JSON is the meta, without body; every later frame is

- ``[stream, [[column, type, shape], ...]]``: a block, whose body is its columns, little-endian, in that order;
- ``{"meta": {field: value, ...}}``: fields that replace those of the meta, without body.

Journals of ``tactbench-partial 1``, with blocks only and without ``device_ns``, can be read, too.
"""

from __future__ import annotations

import itertools
import json
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.errors import FormatError, MissingRecordingError, RecordingError
from tactbench.core.files import try_lock
from tactbench.core.recording import image
from tactbench.core.recording.format import PARTIAL, Array, Columns, canonical, completing_path, readable
from tactbench.core.recording.reader import parse_meta
from tactbench.core.spec.recording import RecordingMeta

MAGIC = b"tactbench-partial 2\n"
_READ = (b"tactbench-partial 1\n", MAGIC)
_FRAME = struct.Struct("<IQI")
"""Head of a frame: length of its JSON, length of its body, CRC-32 of both."""

REMARK = "Rescued: the recording broke off and is not whole."


class Partial:
    """Writer of the journal of one attempt to make a recording at `path`; each attempt has its own file.

    `text` is the meta known so far, as canonical JSON.
    """

    def __init__(self, path: Path, text: str) -> None:
        self.rows: dict[str, int] = {}
        """Number of rows written so far, by stream, for streams with at least one block."""
        self._end = 0
        for attempt in itertools.count(1):  # x.h5.partial, x.h5.2.partial and so on
            self.path = path.with_name(f"{path.name}{'' if attempt == 1 else f'.{attempt}'}{PARTIAL}")
            try:
                flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
                self._file = os.open(self.path, flags, 0o666)
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
        """Write a block to the file; after the return, only a crash of the operating system can lose the block."""
        plain = {name: np.ascontiguousarray(values, values.dtype.newbyteorder("<")) for name, values in columns.items()}
        shapes = [[name, values.dtype.str, list(values.shape)] for name, values in plain.items()]
        head = json.dumps([stream, shapes]).encode()
        self._write(_frame(head, b"".join(values.tobytes() for values in plain.values())))
        self.rows[stream] = self.rows.get(stream, 0) + len(columns["data"])

    def revise(self, changes: Mapping[str, Any]) -> None:
        """Write new values of some of the meta's fields, as plain data; raises ValueError for NaN and infinity."""
        self._write(_frame(json.dumps({"meta": changes}, allow_nan=False).encode(), b""))

    def close(self) -> None:
        """Close the journal's file without removing it."""
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
class JournalBlocks:
    """The blocks of a journal, as the name of the stream and the columns of each; they can be iterated repeatedly.

    An iteration raises FormatError for an invalid block, and RecordingError if there are fewer rows than expected.
    """

    path: Path
    end: int | None = None
    """Length of the part of the file that is read [bytes]; None: the whole file."""
    expected: Mapping[str, int] = field(default_factory=dict)
    """Number of rows that were written, by stream."""

    def __iter__(self) -> Iterator[tuple[str, Columns]]:
        left = dict(self.expected)
        frames = _frames(self.path, self.path.stat().st_size if self.end is None else self.end)
        next(frames, None)
        for head, body, _ in frames:
            if not head.startswith(b"{"):
                with readable(self.path):
                    stream, columns = _block(json.loads(head), body)
                left[stream] = left.get(stream, 0) - len(columns["data"])
                yield stream, columns
        if any(count > 0 for count in left.values()):
            raise RecordingError(f"{self.path} has lost rows (number by stream: {left}).", hint="Check the disk.")


def rescue(path: Path, target: Path) -> None:
    """Convert an unfinished recording into a finished one at `target`, excluded from evaluations as interrupted.

    The file of the unfinished recording is kept; it may still grow: the blocks present at this moment are converted.
    Raises MissingRecordingError if the file does not exist, FormatError if the file is not an unfinished recording, and
    RecordingError if `target` exists, or cannot be written.
    """
    image.require_free(target)
    meta, end = _read(path)
    blocks, rows = JournalBlocks(path, end), Counter[str]()
    for stream, columns in blocks:
        rows[stream] += len(columns["data"])
    meta = meta.model_copy(update={
        "remarks": (*meta.remarks, REMARK),
        "excluded": meta.excluded or "interrupted: the recording broke off, and was rescued",
        "streams": {name: one.model_copy(update={"written": rows[name]}) for name, one in meta.streams.items()},
    })  # fmt: skip
    image.store(target, meta, blocks, {}, aside=completing_path(target))


def _read(path: Path) -> tuple[RecordingMeta, int]:
    """Return the meta in a journal, with all changes written so far, and the end of its last complete frame [bytes]."""
    if not path.is_file():
        raise MissingRecordingError(f"There is no recording {path}.", hint="Check the path.")
    frames = _frames(path, path.stat().st_size)
    text, _, end = next(frames, (b"", b"", 0))
    if not end:
        raise FormatError(f"{path} is not an unfinished recording, or has no complete frame.", hint="Check the path.")
    with readable(path):
        content = json.loads(text)
        for head, _, place in frames:
            end, frame = place, json.loads(head)
            if "meta" in frame:
                content.update(frame["meta"])
        return parse_meta(path, canonical(content)), end


def _frame(head: bytes, body: bytes) -> bytes:
    return _FRAME.pack(len(head), len(body), zlib.crc32(body, zlib.crc32(head))) + head + body


def _frames(path: Path, end: int) -> Iterator[tuple[bytes, bytes, int]]:
    """Yield the head, the body and the end [bytes] of every frame before the first incomplete or damaged frame."""
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
