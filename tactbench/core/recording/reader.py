"""Reading recordings; nothing in a file from a stranger is executed, and nothing outside it is opened."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from tactbench.core.errors import FormatError, MissingRecordingError, UsageError
from tactbench.core.recording import format as layout
from tactbench.core.recording import trust
from tactbench.core.samples import StreamData
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


class LazyStream:
    """A stream in an open recording: nothing is read until it is sliced."""

    def __init__(
        self, path: Path, spec: StreamSpec, group: Any, meta: RecordingMeta, *, version: int, strict: bool
    ) -> None:
        self.spec = spec
        self._path = path
        self._columns = _columns(path, spec, group, meta, version=version, strict=strict)
        lengths = {int(dataset.shape[0]) for dataset in self._columns.values()}
        if strict and len(lengths) > 1:
            raise FormatError(f"In {path}, the columns of {spec.name!r} differ in length.", hint=trust.SEE)
        self._rows = min(lengths)

    def __len__(self) -> int:
        return self._rows

    def __getitem__(self, rows: slice) -> StreamData:
        """Read the rows of a slice, and no others; FormatError if they are damaged."""
        rows = slice(*rows.indices(self._rows))
        try:
            read = {name: self._read(name, rows) for name in self._columns}
        except trust.READ_FAILURES as error:
            raise _damaged(self._path, error) from error
        notes = {name[len(_NOTE) :]: column for name, column in read.items() if name.startswith(_NOTE)}
        return StreamData(
            spec=self.spec,
            t_ns=read.get("t_ns"),
            data=read["data"],
            quality=read.get("quality"),
            annotations=notes,
            sequence=read.get("sequence"),
            device_ns=read.get("device_ns"),
            host_ns=read.get("host_ns"),
        )

    def add_to(self, digest: layout.ContentDigest) -> None:
        """Add every column to the digest, by its name below the stream."""
        for name in sorted(self._columns):
            where = f"/{self.spec.name}/{name}"
            first = self._read(name, slice(0, 0))
            if first.dtype.kind == "U":
                digest.texts(where, self._read(name, slice(0, self._rows)))
            else:
                pieces = (self._read(name, rows) for rows in _slices(self._rows))
                digest.numbers(where, first.dtype, (self._rows, *first.shape[1:]), pieces)

    def _read(self, name: str, rows: slice) -> npt.NDArray[Any]:
        dataset = self._columns[name]
        if name.startswith(_NOTE):
            return trust.labels_of(dataset, rows)
        values = dataset[rows]
        native: npt.NDArray[Any] = values.astype(values.dtype.newbyteorder("="), copy=False)
        return native


class Recording:
    """An open recording; use it as a context manager, or :meth:`close` it.

    Attributes
    ----------
    path
        The file.
    meta
        What the recording says about itself.
    complete
        False for what a crash left behind.
    version
        That of the file's format.
    stream_names
        Names of the streams that hold data, the sensor's first, in the order of the specs.
    """

    def __init__(self, path: Path, file: Any, text: str, *, complete: bool) -> None:
        self.path = path
        self.meta = parse_meta(path, text)
        self.complete = complete
        self.version = int(file.attrs["format_version"])
        self._text = text
        self._file = file
        self._specs = layout.specs_by_name(self.meta)
        self._looked_at: dict[str, LazyStream] = {}
        self._streams = trust.subgroup(path, file, "streams")
        if self._streams is None:
            raise FormatError(f"{path} has no streams.", hint=trust.SEE)
        self.stream_names = tuple(name for name in self._specs if name in self._streams)

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def stream(self, name: str) -> LazyStream:
        """Return a stream to slice.

        Raises
        ------
        FormatError
            If the recording has no such stream, or the file contradicts its own meta.
        """
        if name not in self.stream_names:
            raise FormatError(
                f"{self.path} has no stream {name!r}; it has {', '.join(self.stream_names) or 'none'}.",
                hint="See what is in it with `tactbench inspect`.",
            )
        if name in self._looked_at:
            return self._looked_at[name]
        try:
            group = trust.subgroup(self.path, self._streams, name)
            stream = LazyStream(
                self.path, self._specs[name], group, self.meta, version=self.version, strict=self.complete
            )
        except FormatError:
            raise
        except trust.READ_FAILURES as error:
            raise _damaged(self.path, error) from error
        self._looked_at[name] = stream
        return stream

    def read(self, name: str) -> StreamData:
        """Read a whole stream; FormatError if there is none, or if it is damaged."""
        return self.stream(name)[:]

    def content_digest(self) -> str:
        """Return the digest of what the recording says, computed from the data now."""
        digest = layout.ContentDigest(self._text, self.version)
        for name in sorted(self.stream_names):
            stream = self.stream(name)
            try:
                stream.add_to(digest)
            except trust.READ_FAILURES as error:
                raise _damaged(self.path, error) from error
        return digest.hexdigest()

    def verify(self) -> str:
        """Compare the data with the digest that was written with it, and return it; FormatError if they differ."""
        digest = self.content_digest()
        if digest != self._file.attrs.get("content_sha256", ""):
            raise FormatError(
                f"{self.path} does not hold what was written: its content digest differs.",
                hint="The file was changed or damaged afterwards; get it again from its source, or record it again.",
            )
        return digest


def open_recording(path: Path) -> Recording:
    """Open a finished recording.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not a recording, is damaged or unfinished, or was written by a newer tactbench.
    """
    return _open(Path(path))


def read_meta(path: Path) -> RecordingMeta:
    """Return what a recording says about itself."""
    with open_recording(path) as recording:
        return recording.meta


def content_digest(path: Path) -> str:
    """Return the digest of what a recording says; FormatError if that is not what was written."""
    with open_recording(path) as recording:
        return recording.verify()


_NOTE = "annotations/"
_DIGEST_ROWS = 64 * layout.CHUNK_ROWS
"""Rows that are in memory at a time for the digest; whole chunks, so that none is decompressed twice."""


def _slices(rows: int) -> Iterator[slice]:
    for start in range(0, rows, _DIGEST_ROWS):
        yield slice(start, min(start + _DIGEST_ROWS, rows))


def _columns(
    path: Path, spec: StreamSpec, group: Any, meta: RecordingMeta, *, version: int, strict: bool
) -> dict[str, Any]:
    """Return the datasets of a stream by their name below it, each looked at but not read."""
    data = trust.numbers(path, group, "data", "iuf", 2, strict=strict)
    declared = np.dtype(spec.dtype)
    if data is None or data.shape[1] != len(spec.channels) or data.dtype.newbyteorder("=") != declared:
        what = "no data" if data is None else f"{data.dtype} in {data.shape[1]} columns"
        raise FormatError(
            f"In {path}, stream {spec.name!r} holds {what}; its spec says {declared} in {len(spec.channels)}.",
            hint=trust.SEE,
        )
    columns: dict[str, Any] = {
        "data": data,
        "t_ns": trust.numbers(path, group, "t_ns", "i", 1, strict=strict),
        "quality": trust.numbers(path, group, "quality", "u", 2, strict=strict),
        "sequence": trust.numbers(path, group, "sequence", "i", 1, strict=strict),
    }
    if (columns["t_ns"] is None) != (meta.clock == "none"):
        has = "no time stamps" if columns["t_ns"] is None else "time stamps"
        raise FormatError(
            f"In {path}, stream {spec.name!r} has {has}, but its clock is {meta.clock!r}.", hint=trust.SEE
        )
    if version >= 2:
        for name in ("device_ns", "host_ns"):
            columns[name] = trust.numbers(path, group, name, "i", 1, strict=strict)
        fitted = spec.name in meta.clocks and bool(meta.clocks[spec.name].segments)
        if (columns["host_ns"] is not None) != fitted or (fitted and columns["device_ns"] is None):
            raise FormatError(
                f"In {path}, the times of {spec.name!r} do not go with what the meta says of its clock.",
                hint=trust.SEE,
            )
    if columns["quality"] is not None and columns["quality"].shape[1] != len(spec.channels):
        raise FormatError(f"In {path}, the quality of {spec.name!r} has another shape than its data.", hint=trust.SEE)
    notes = trust.subgroup(path, group, "annotations")
    for name in notes if notes is not None else ():
        columns[_NOTE + name] = trust.annotation(path, notes, name, strict=strict)
    return {name: dataset for name, dataset in columns.items() if dataset is not None}


def _open(path: Path) -> Recording:
    import h5py

    if not path.is_file():
        raise MissingRecordingError(f"There is no recording {path}.", hint="Check the path.")
    try:
        # Best effort: some network disks know no locks, and a finished recording never changes.
        file = h5py.File(path, "r", locking="best-effort")
    except PermissionError as error:
        raise FormatError(f"{path} cannot be read: {error.strerror}.", hint="Check its permissions.") from error
    except trust.READ_FAILURES as error:
        raise FormatError(
            f"{path} is not an HDF5 file, or it was cut short: {error}.",
            hint="Get it again from its source; `….partial` files are what a crash left behind.",
        ) from error
    try:
        return Recording(path, file, _envelope(path, file), complete=True)
    except FormatError:
        file.close()
        raise
    except trust.READ_FAILURES as error:
        file.close()
        raise _damaged(path, error) from error
    except BaseException:
        file.close()
        raise


def _envelope(path: Path, file: Any) -> str:
    """Return the meta text."""
    if file.attrs.get("format") != layout.FORMAT:
        raise FormatError(
            f"{path} is an HDF5 file, but not a tactbench recording.",
            hint="Turn foreign files into recordings with `tactbench import MAPPING.yaml`.",
        )
    version = int(file.attrs["format_version"])
    if version > layout.VERSION:
        raise FormatError(
            f"{path} has format version {version}; this tactbench reads up to {layout.VERSION}.",
            hint="Install a newer tactbench.",
        )
    if version < 1:
        raise FormatError(f"{path} has format version {version}, which never was.", hint=trust.SEE)
    if not bool(file.attrs.get("complete", False)):
        raise FormatError(f"{path} was not finished.", hint="Record it again.")
    text = file.attrs["meta"]
    text = bytes(text).decode() if isinstance(text, bytes) else str(text)
    text.encode()  # h5py keeps bytes that are no UTF-8 as surrogates
    if len(text) > layout.MAX_META_CHARACTERS:
        raise FormatError(f"{path} has a meta text of {len(text)} characters.", hint=trust.SEE)
    return text


def parse_meta(path: Path, text: str) -> RecordingMeta:
    """Return a meta text as a model; FormatError, naming `path`, if it makes no sense."""
    try:
        content = json.loads(text)
        if "\\ud" in text or "\\uD" in text:  # a surrogate, perhaps without its other half: nothing can print it
            layout.canonical(content).encode()
    except (ValueError, RecursionError) as error:
        raise _damaged(path, error) from error
    try:
        return RecordingMeta.model_validate(content)
    except UsageError as error:
        raise FormatError(f"{path} says something that cannot be: {error.message}", hint=trust.SEE) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise FormatError(
            f"{path} says something about itself that cannot be: {where}: {first['msg']}.", hint=trust.SEE
        ) from error


def _damaged(path: Path, error: BaseException) -> FormatError:
    return FormatError(f"{path} is damaged: {error}.", hint="Get it again from its source, or record it again.")
