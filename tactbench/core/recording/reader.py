"""Reading recordings; nothing in a file from a stranger is executed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from tactbench.core.errors import FormatError, MissingRecordingError
from tactbench.core.recording import format as layout
from tactbench.core.samples import StreamData
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


class LazyStream:
    """A stream in an open recording: nothing is read until it is sliced."""

    def __init__(self, spec: StreamSpec, group: Any) -> None:
        self.spec = spec
        self._group = group

    def __len__(self) -> int:
        return int(self._group["data"].shape[0])

    def __getitem__(self, rows: slice) -> StreamData:
        """Read the rows of a slice, and no others."""
        group = self._group
        notes = group.get("annotations", {})
        return StreamData(
            spec=self.spec,
            t_ns=group["t_ns"][rows] if "t_ns" in group else None,
            data=group["data"][rows],
            quality=group["quality"][rows] if "quality" in group else None,
            annotations={name: _annotation(notes[name], rows) for name in notes},
        )


class Recording:
    """An open recording; use it as a context manager, or :meth:`close` it.

    Attributes
    ----------
    meta
        What the recording says about itself.
    complete
        False for what a crash left behind.
    """

    def __init__(self, path: Path, file: Any, meta: RecordingMeta, *, complete: bool) -> None:
        self.path = path
        self.meta = meta
        self.complete = complete
        self._file = file
        self._specs = layout.specs_by_name(meta)

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def stream_names(self) -> tuple[str, ...]:
        """Names of the streams that hold data, the sensor's first, in the order of the specs."""
        return tuple(name for name in self._specs if name in self._file["streams"])

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
        group, spec = self._file["streams"][name], self._specs[name]
        _check_stream(self.path, name, group, spec)
        return LazyStream(spec, group)

    def read(self, name: str) -> StreamData:
        """Read a whole stream."""
        return self._guarded(name, slice(None))

    def _guarded(self, name: str, rows: slice) -> StreamData:
        try:
            return self.stream(name)[rows]
        except (OSError, KeyError, RuntimeError) as error:
            raise _damaged(self.path, error) from error

    def content_digest(self) -> str:
        """Return the digest of what the recording says, computed from the data now."""
        try:
            return digest_of(self._file, self.meta)
        except (OSError, KeyError, RuntimeError) as error:
            raise _damaged(self.path, error) from error

    def verify(self) -> None:
        """Compare the data with the digest that was written with it; raises FormatError if they differ."""
        written = self._file.attrs.get("content_sha256", "")
        if self.content_digest() != written:
            raise FormatError(
                f"{self.path} does not hold what was written: its content digest differs.",
                hint="The file was changed or damaged afterwards; get it again from its source.",
            )


def open_recording(path: Path) -> Recording:
    """Open a finished recording.

    Raises
    ------
    MissingRecordingError
        If there is no such file.
    FormatError
        If it is not a recording, is damaged or unfinished, or was written by a newer tactbench.
    """
    return _open(Path(path), unfinished=False)


def salvage(path: Path) -> Recording:
    """Open what a crash left behind (``….partial``): every block that had been flushed can be read."""
    return _open(Path(path), unfinished=True)


def read_meta(path: Path) -> RecordingMeta:
    """Return what a recording says about itself."""
    with open_recording(path) as recording:
        return recording.meta


def content_digest(path: Path) -> str:
    """Return the digest of what a recording says."""
    with open_recording(path) as recording:
        return recording.content_digest()


def digest_of(file: Any, meta: RecordingMeta) -> str:
    """Return the content digest of an open HDF5 file with this meta."""
    digest = layout.ContentDigest(meta)
    for name, dataset in sorted(_datasets(file["streams"], "")):
        digest.array(name, _plain(dataset))
    return digest.hexdigest()


def _datasets(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name in group:
        item = group[name]
        if hasattr(item, "shape"):
            yield f"{prefix}/{name}", item
        else:
            yield from _datasets(item, f"{prefix}/{name}")


def _plain(dataset: Any) -> npt.NDArray[Any]:
    if dataset.dtype.kind == "O":
        return _annotation(dataset, slice(None))
    values: npt.NDArray[Any] = dataset[:]
    return values


def _annotation(dataset: Any, rows: slice) -> npt.NDArray[Any]:
    import h5py

    if h5py.check_string_dtype(dataset.dtype) is not None:
        return np.array(dataset.asstr()[rows], dtype=np.str_)
    if dataset.dtype.kind not in "iu":
        raise FormatError(
            f"The annotation {dataset.name} holds {dataset.dtype}; only text and whole numbers are read.",
            hint="See docs/format.md.",
        )
    return np.asarray(dataset[rows])


def _open(path: Path, *, unfinished: bool) -> Recording:
    import h5py

    if not path.is_file():
        raise MissingRecordingError(f"There is no recording {path}.", hint="Check the path.")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise FormatError(
            f"{path} is not an HDF5 file, or it was cut short: {error}.",
            hint="Get it again from its source; `….partial` files are what a crash left behind.",
        ) from error
    try:
        meta = _meta(path, file, unfinished=unfinished)
        complete = bool(file.attrs.get("complete", False))
    except BaseException:
        file.close()
        raise
    return Recording(path, file, meta, complete=complete)


def _meta(path: Path, file: Any, *, unfinished: bool) -> RecordingMeta:
    try:
        kind = file.attrs.get("format")
        if kind != layout.FORMAT:
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
        if not unfinished and not bool(file.attrs.get("complete", False)):
            raise FormatError(f"{path} was not finished.", hint="Record it again; a crash cut it short.")
        if file.attrs.get_id("meta").get_storage_size() > layout.MAX_META_BYTES:
            raise FormatError(f"{path} has a meta text that is too large.", hint="See docs/format.md.")
        text = file.attrs["meta"]
        if "streams" not in file:
            raise FormatError(f"{path} has no streams.", hint="See docs/format.md.")
        return RecordingMeta.model_validate(json.loads(bytes(text).decode()))
    except (KeyError, OSError, RuntimeError, TypeError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise _damaged(path, error) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise FormatError(
            f"{path} says something about itself that cannot be: {where}: {first['msg']}.", hint="See docs/format.md."
        ) from error


def _check_stream(path: Path, name: str, group: Any, spec: StreamSpec) -> None:
    try:
        data = group["data"]
        good = data.ndim == 2 and data.shape[1] == len(spec.channels) and data.dtype.kind in "iuf"
        for other in ("t_ns", "quality", "sequence"):
            if other in group:
                good = good and group[other].shape[0] == data.shape[0] and group[other].dtype.kind in "iu"
    except (KeyError, AttributeError, OSError, RuntimeError) as error:
        raise _damaged(path, error) from error
    if not good:
        raise FormatError(
            f"In {path}, stream {name!r} does not have the shape its spec states.", hint="See docs/format.md."
        )


def _damaged(path: Path, error: Exception) -> FormatError:
    return FormatError(f"{path} is damaged: {error}.", hint="Get it again from its source, or record it again.")
