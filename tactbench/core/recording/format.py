"""Names and rules of the recordings' file format; ``docs/format.md`` is its specification."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import FormatError
from tactbench.core.files import utf8_json
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec

FORMAT = "tactbench-recording"
VERSION = 4
"""Version of the file format for writing; for reading, all versions from 1 on."""
PARTIAL = ".partial"
"""File name ending of a journal, which contains the blocks of an unfinished recording."""
COMPLETING = ".completing"
"""File name ending of a finished recording until it is checked by reading it back, and renamed."""

ROWS, CHANNELS = "row", "channel"
"""Names of a stream's HDF5 dimension scales: for the rows of a stream without a clock, and for the channels. The
content digest leaves both scales out."""
CHUNK_ROWS = 1024

SEE = "See docs/format.md."

Array = npt.NDArray[Any]
Annotations = Mapping[str, Mapping[str, Array]]
"""Labels of rows, by name of the stream and of the label: (n,) texts or whole numbers."""
Columns = dict[str, Array]
"""Columns of a stream by name: data and quality (n, channels); t_ns [ns], sequence and device_ns [ns], (n,) each."""
Blocks = Iterable[tuple[str, Columns]]
"""Name of the stream and columns of each block, in the order of receipt."""


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Return a context manager that raises errors of reading a damaged file as FormatError, which names `path`."""
    try:
        yield
    except FormatError:
        raise
    except (OSError, LookupError, RuntimeError, ValueError, TypeError, AttributeError, OverflowError) as error:
        hint = "Get the file again from its source, or record again."
        raise FormatError(f"{path} is damaged: {error}.", hint=hint) from error


def piece_rows(channels: int) -> int:
    """Return the number of rows to read or compress at a time: 1 to 16 chunks, with some two million values at most."""
    return min(max(2**21 // channels // CHUNK_ROWS, 1), 16) * CHUNK_ROWS


def canonical(content: Any) -> str:
    """Return plain data as canonical JSON (sorted keys, no spaces); raises ValueError for NaN and infinity."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return utf8_json(text)


def meta_text(meta: RecordingMeta) -> str:
    """Return the description of a recording as canonical JSON."""
    return canonical(meta.model_dump(mode="json"))


class ContentDigest:
    """SHA-256 of a recording's content; equal content has an equal digest in every file, machine and library version.

    `text` is the meta as stored in the file: fields that later versions of the model add must not change the digest.
    `version` is that of the file's format.
    """

    def __init__(self, text: str, version: int = VERSION) -> None:
        # The rig computes `plan` and `drawn` on the way to the samples: processors may differ in their last bit.
        left_out = ("provenance",) if version < 3 else ("name", "plan", "drawn", "provenance")
        content = {name: value for name, value in json.loads(text).items() if name not in left_out}
        self._version = version
        self._columns: dict[tuple[str, str, tuple[int, ...]], tuple[Any, list[int]]] = {}
        """SHA-256 and number of the rows added so far, by name, type and shape of a row of the column."""
        self._sha = hashlib.sha256(f"{FORMAT} {version}\n{canonical(content)}\n".encode())

    def add(self, name: str, values: Array) -> None:
        """Add rows of a column; for files before version 4, add whole columns, in the order of the streams."""
        if values.dtype.kind == "U":
            kind = "text"
            body: Any = "".join(f"{canonical(text)}\n" for text in values.tolist()).encode()
        else:
            kind = values.dtype.newbyteorder("<").str
            body = np.ascontiguousarray(values, dtype=kind).data
        if self._version < 4:
            whole = f"{canonical(values.tolist())}\n".encode() if kind == "text" else body
            self._sha.update(f"{name} {kind} {values.shape}\n".encode())
            self._sha.update(whole)
            return
        sha, rows = self._columns.setdefault((name, kind, values.shape[1:]), (hashlib.sha256(), [0]))
        sha.update(body)
        rows[0] += len(values)

    def hexdigest(self) -> str:
        """Return the SHA-256 of the meta and of all rows added, as hexadecimal text."""
        sha = self._sha.copy()
        for (name, kind, rest), (column, (rows,)) in sorted(self._columns.items()):
            sha.update(f"{name} {kind} {(rows, *rest)} {column.hexdigest()}\n".encode())
        return sha.hexdigest()


def specs_by_name(meta: RecordingMeta) -> dict[str, StreamSpec]:
    """Return the specs of all streams that a recording may contain, of sensor and reference, by name."""
    return {stream.name: stream for stream in (*meta.sensor.streams, *meta.reference)}


def completing_path(path: Path) -> Path:
    """Return the temporary path of a finished file, given the path of its journal or of the recording."""
    return path.with_name(path.name.removesuffix(PARTIAL) + COMPLETING)
