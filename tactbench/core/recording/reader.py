"""Reading of recordings from their files, as far as their data are needed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from tactbench.core.errors import FormatError, MissingRecordingError, UsageError, complaint
from tactbench.core.recording import format as layout
from tactbench.core.recording.format import Array
from tactbench.core.samples import COLUMNS, IntArray, StreamData
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec

_NOTE = "annotations/"
_COLUMNS = (*COLUMNS, "host_ns")


class LazyStream:
    """A stream of an open recording; a slice of it reads only the rows of the slice."""

    def __init__(self, path: Path, spec: StreamSpec, columns: dict[str, Any]) -> None:
        self.spec = spec
        self._path = path
        self._columns = columns
        self.annotations = tuple(name.removeprefix(_NOTE) for name in columns if name.startswith(_NOTE))
        """Names of the labels that every row of the stream has."""

    def __len__(self) -> int:
        return int(self._columns["data"].shape[0])

    def __getitem__(self, rows: slice) -> StreamData:
        """Read and return only the rows of a slice; raises FormatError if the file is damaged there."""
        read: dict[str, Any] = {"t_ns": None, "quality": None}
        read |= {name: self._read(name, rows) for name in self._columns}
        notes = {name: read.pop(_NOTE + name) for name in self.annotations}
        return StreamData(spec=self.spec, annotations=notes, **read)

    def blocks(self) -> Iterator[StreamData]:
        """Yield the whole stream in consecutive blocks of rows, some 16 MiB each."""
        return (self[rows] for rows in self._pieces())

    def times(self) -> IntArray | None:
        """Return the times of all rows, (n,) [ns]; None if the recording has no clock."""
        return self._read("t_ns", slice(None)) if "t_ns" in self._columns else None

    def add_to(self, digest: layout.ContentDigest, *, whole: bool) -> None:
        """Add every column to a content digest under its path in the file, `whole` or in blocks of rows."""
        for name in sorted(self._columns):
            for rows in [slice(None)] if whole or not len(self) else self._pieces():
                digest.add(f"/{self.spec.name}/{name}", self._read(name, rows))

    def _pieces(self) -> Iterator[slice]:
        step = layout.piece_rows(len(self.spec.channels))
        return (slice(start, start + step) for start in range(0, len(self), step))

    def _read(self, name: str, rows: slice) -> Array:
        import h5py

        dataset = self._columns[name]
        with layout.readable(self._path):
            if h5py.check_string_dtype(dataset.dtype) is not None:
                return np.array(dataset.asstr("utf-8")[rows], dtype=np.str_)
            values = np.asarray(dataset[rows])
            number = name.startswith(_NOTE) and values.dtype.kind != "U"
            kept: Any = np.int64 if number else values.dtype.newbyteorder("=")
            return values.astype(kept, copy=False)


class Recording:
    """An open recording; as a context manager, it closes its file.

    Attributes
    ----------
    path
        Path of the file.
    meta
        Description of the recording.
    version
        Version of the file's format.
    stream_names
        Names of the streams that hold data, the sensor's first, in the order of the specs.
    """

    def __init__(self, path: Path, file: Any, text: str) -> None:
        self.path = path
        self.meta = parse_meta(path, text)
        self.version = int(file.attrs["format_version"])
        self._text = text
        self._file = file
        self._specs = layout.specs_by_name(self.meta)
        self._streams = file["streams"]
        self._opened: dict[str, LazyStream] = {}
        self.stream_names = tuple(name for name in self._specs if name in self._streams)

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def stream(self, name: str) -> LazyStream:
        """Return the stream `name`, of which slices can be read.

        Raises FormatError if the recording has no such stream, or the file contradicts its own meta.
        """
        if name not in self.stream_names:
            raise FormatError(
                f"{self.path} has no stream {name!r}; it has {', '.join(self.stream_names) or 'none'}.",
                hint="List its streams with `tactbench inspect`.",
            )
        if name not in self._opened:
            with layout.readable(self.path):
                columns = _columns(self.path, self._specs[name], self._streams[name])
            self._opened[name] = LazyStream(self.path, self._specs[name], columns)
        return self._opened[name]

    def read(self, name: str) -> StreamData:
        """Read a whole stream; raises FormatError if the recording has no such stream, or the file is damaged."""
        return self.stream(name)[:]

    def verify(self) -> str:
        """Return the computed content digest; raises FormatError if it differs from the digest stored in the file."""
        content = layout.ContentDigest(self._text, self.version)
        for name in sorted(self.stream_names):
            self.stream(name).add_to(content, whole=self.version < 4)
        digest = content.hexdigest()
        if digest != self._file.attrs.get("content_sha256", ""):
            raise FormatError(
                f"{self.path} was changed or damaged: its content digest differs from the stored one.",
                hint="Get the file again from its source, or record it again.",
            )
        return digest


class UnwrittenRecording(Recording):
    """A recording in memory, without labels of rows, for checks before it is written."""

    def __init__(self, meta: RecordingMeta, streams: Iterable[StreamData]) -> None:
        self.path, self.meta = Path(meta.name), meta
        there = {one.spec.name: one for one in streams}
        self.stream_names = tuple(name for name in layout.specs_by_name(meta) if name in there)
        self._opened = {}
        for name in self.stream_names:
            columns = {column: getattr(there[name], column) for column in _COLUMNS}
            kept = {column: values for column, values in columns.items() if values is not None}
            self._opened[name] = LazyStream(self.path, there[name].spec, kept)


def open_recording(path: Path) -> Recording:
    """Open a finished recording.

    Raises MissingRecordingError if the file does not exist, and FormatError if the file is not a recording, is damaged
    or unfinished, or was written by a newer tactbench.
    """
    import h5py

    if not path.is_file():
        raise MissingRecordingError(f"There is no recording {path}.", hint="Check the path.")
    try:
        try:
            # Best effort: some network disks know no locks, and a finished recording never changes.
            file = h5py.File(path, "r", locking="best-effort")
        except BlockingIOError:  # another program holds it open for writing
            file = h5py.File(path, "r", locking=False)
    except (OSError, RuntimeError, ValueError) as error:
        raise FormatError(
            f"{path} cannot be read, is not an HDF5 file, or was cut short: {error}.",
            hint="Check permissions, or get the file again; convert files `….partial` left by a crash with `--rescue`.",
        ) from error
    try:
        with layout.readable(path):
            return Recording(path, file, _envelope(path, file))
    except BaseException:
        file.close()
        raise


def read_meta(path: Path) -> RecordingMeta:
    """Return the meta, the description, of the recording in a file."""
    with open_recording(path) as recording:
        return recording.meta


def content_digest(path: Path) -> str:
    """Return the content digest of a recording; raises FormatError if it differs from the digest stored in the file."""
    with open_recording(path) as recording:
        return recording.verify()


def _columns(path: Path, spec: StreamSpec, group: Any) -> dict[str, Any]:
    """Return a stream's HDF5 datasets by path in its group; raises FormatError if the datasets contradict the meta."""
    columns = {name: group[name] for name in _COLUMNS if name in group}
    columns |= {_NOTE + name: item for name, item in group.get("annotations", {}).items()}
    rows, *rest = group["data"].shape
    stored = group["data"].dtype.newbyteorder("=")
    alike = all(len(one) == rows for one in columns.values())
    if not alike or (stored, rest) != (np.dtype(spec.dtype), [len(spec.channels)]):
        raise FormatError(
            f"In {path}, the data of stream {spec.name!r} are {stored} of shape {(rows, *rest)}, where {spec.dtype} of "
            f"{len(spec.channels)} channels is expected, or columns differ in length.",
            hint=layout.SEE,
        )
    return columns


def _envelope(path: Path, file: Any) -> str:
    """Return the meta of an HDF5 file as text; raises FormatError for a file other than a finished recording."""
    if file.attrs.get("format") != layout.FORMAT:
        raise FormatError(
            f"{path} is an HDF5 file, but not a tactbench recording.",
            hint="Turn foreign files into recordings with `tactbench import MAPPING.yaml`.",
        )
    version = int(file.attrs["format_version"])
    if not 1 <= version <= layout.VERSION:
        raise FormatError(
            f"{path} has format version {version}; this tactbench reads 1 to {layout.VERSION}.",
            hint="Install a newer tactbench.",
        )
    if not bool(file.attrs.get("complete", False)):
        raise FormatError(f"{path} was not finished.", hint="Record it again.")
    text = file.attrs["meta"]
    return text.decode() if isinstance(text, bytes) else str(text)


def parse_meta(path: Path, text: str) -> RecordingMeta:
    """Return the meta parsed from JSON text; raises FormatError, which names `path`, if the text is not valid."""
    try:
        return RecordingMeta.model_validate(json.loads(text))
    except (ValueError, UsageError) as error:
        what = complaint(error) if isinstance(error, ValidationError) else str(error)
        raise FormatError(f"The meta of {path} is not valid: {what}.", hint=layout.SEE) from error
