"""Writing a recording, so that a crash loses at most the block in flight."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import RecordingError, RigError
from tactbench.core.recording import format as layout
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


class RecordingWriter:
    """Writes one recording; use it as a context manager.

    While it is open the file is called ``<path>.partial`` and holds, after every block, all blocks so far. Leaving
    the context completes it: content digest, sync, rename to `path`. Leaving it by an exception removes it; only a
    crash of the process leaves the ``.partial`` behind, for :func:`tactbench.core.recording.reader.salvage`.

    Parameters
    ----------
    path
        Where the finished recording shall lie.
    meta
        What it says about itself; :meth:`revise` changes it until the end.
    """

    def __init__(self, path: Path, meta: RecordingMeta) -> None:
        self.path = path
        self.meta = meta
        self._aside = layout.partial_path(path)
        self._specs = layout.specs_by_name(meta)
        self._file: Any = None
        self.content_digest = ""
        """Digest of what was written, once the recording is complete."""

    def __enter__(self) -> RecordingWriter:
        import h5py

        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = h5py.File(self._aside, "w")
        except OSError as error:
            raise _cannot_write(self.path, error) from error
        self._file.attrs["format"] = layout.FORMAT
        self._file.attrs["format_version"] = layout.VERSION
        self._file.attrs["complete"] = False
        self._file.attrs["NX_class"] = "NXroot"
        self._write_meta()
        self._file.create_group("streams").attrs["NX_class"] = "NXentry"
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            self._close()
            self._aside.unlink(missing_ok=True)
            return
        try:
            self._complete()
        except OSError as failure:
            self._aside.unlink(missing_ok=True)
            raise _cannot_write(self.path, failure) from failure

    def revise(self, **changes: Any) -> None:
        """Change fields of the meta that are known only at the end (`drawn`, `counts`, `provenance` …)."""
        self.meta = self.meta.model_copy(update=changes)

    def append(self, block: Block) -> None:
        """Add `block` to its stream and flush it.

        Raises
        ------
        RigError
            If the block does not fit its stream: unknown name, wrong number of channels, or times that disagree in
            number with the rows.
        RecordingError
            If the disk refuses it.
        """
        spec = self._checked(block)
        try:
            group = self._group(spec, block)
            data = group["data"]
            start, stop = data.shape[0], data.shape[0] + len(block.data)
            for name, values in _columns(block, spec):
                group[name].resize(stop, axis=0)
                group[name][start:stop] = values
            self._file.flush()
        except OSError as error:
            raise _cannot_write(self.path, error) from error

    def annotate(self, stream: str, name: str, values: Sequence[str] | npt.NDArray[Any]) -> None:
        """Attach a label to every row of `stream`: text or whole numbers, one a row."""
        import h5py

        group = self._file[f"streams/{stream}"]
        column = np.asarray(values)
        if len(column) != group["data"].shape[0]:
            raise RigError(
                f"The annotation {name!r} has {len(column)} values for {group['data'].shape[0]} rows of {stream!r}.",
                hint="Give one value a row, after the last block.",
            )
        notes = group.require_group("annotations")
        if column.dtype.kind in "iu":
            notes.create_dataset(name, data=column.astype(np.int64), compression="gzip", shuffle=True)
        else:
            texts = [str(value) for value in column]
            notes.create_dataset(name, data=texts, dtype=h5py.string_dtype("utf-8"), compression="gzip")

    def _checked(self, block: Block) -> StreamSpec:
        spec = self._specs.get(block.stream)
        if spec is None:
            raise RigError(
                f"A block of stream {block.stream!r} came; the recording has {', '.join(sorted(self._specs))}.",
                hint="Declare the stream in the sensor's spec or the rig's reference.",
            )
        if block.data.ndim != 2 or block.data.shape[1] != len(spec.channels):
            raise RigError(
                f"A block of stream {block.stream!r} has shape {block.data.shape}, not (n, {len(spec.channels)}).",
                hint="A block is rows by channels, in the order of the stream's spec.",
            )
        for name, values in (("t_ns", block.t_ns), ("sequence", block.sequence), ("quality", block.quality)):
            if values is not None and len(values) != len(block.data):
                raise RigError(
                    f"A block of stream {block.stream!r} has {len(block.data)} rows but {len(values)} of {name}.",
                    hint="Give one of each a row.",
                )
        return spec

    def _group(self, spec: StreamSpec, block: Block) -> Any:
        groups = self._file["streams"]
        if spec.name in groups:
            return groups[spec.name]
        group = groups.create_group(spec.name)
        group.attrs["NX_class"] = "NXdata"
        group.attrs["signal"] = "data"
        if spec.rate_hz is not None:
            group.attrs["rate_hz"] = spec.rate_hz
        for name, values in _columns(block, spec):
            shape = (0, *values.shape[1:])
            group.create_dataset(
                name, shape=shape, maxshape=(None, *values.shape[1:]), dtype=values.dtype,
                chunks=(layout.CHUNK_ROWS, *values.shape[1:]), compression="gzip", compression_opts=4, shuffle=True,
            )  # fmt: skip
        if "t_ns" in group:
            group.attrs["axes"] = ["t_ns", "."]
            group["t_ns"].attrs["units"] = "ns"
        units = {channel.unit for channel in spec.channels}
        group["data"].attrs["units"] = units.pop() if len(units) == 1 else "mixed: see channel_units"
        for name, values in layout.channel_attributes(spec):
            group.attrs[name] = values
        return group

    def _write_meta(self) -> None:
        self._file.attrs["meta"] = np.bytes_(layout.meta_text(self.meta).encode())  # fixed length: no 64 KiB limit

    def _complete(self) -> None:
        from tactbench.core.recording.reader import digest_of

        self._write_meta()
        self.content_digest = digest_of(self._file, self.meta)
        self._file.attrs["content_sha256"] = self.content_digest
        self._file.attrs["complete"] = True
        self._close()
        with self._aside.open("rb") as written:
            os.fsync(written.fileno())
        self._aside.replace(self.path)
        folder = os.open(self.path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def _columns(block: Block, spec: StreamSpec) -> list[tuple[str, npt.NDArray[Any]]]:
    """Return what is stored of `block`, by dataset; quality only where the first block has any."""
    columns: list[tuple[str, npt.NDArray[Any]]] = [("data", _stored(block.data, spec))]
    if block.t_ns is not None:
        columns.append(("t_ns", np.asarray(block.t_ns, dtype=np.int64)))
    if block.sequence is not None:
        columns.append(("sequence", np.asarray(block.sequence, dtype=np.int64)))
    quality = block.quality if block.quality is not None else np.zeros(block.data.shape, dtype=np.uint8)
    columns.append(("quality", quality.astype(np.uint8)))
    return columns


def _stored(data: npt.NDArray[Any], spec: StreamSpec) -> npt.NDArray[Any]:
    wanted = np.dtype(spec.dtype)
    if wanted.kind == "f" or data.dtype == wanted:
        return data.astype(wanted, copy=False)
    stored = data.astype(wanted)
    if not np.array_equal(stored, data):
        raise RigError(
            f"Stream {spec.name!r} stores {spec.dtype}, and a reading does not fit it without loss.",
            hint="Round and clip in the rig, or declare a wider dtype in the sensor's spec.",
        )
    return stored


def missing_marked(data: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    """Return the quality of `data` in which NaN stands for a sample that is not there."""
    return np.where(np.isnan(data), Quality.MISSING, Quality.GOOD).astype(np.uint8)


def _cannot_write(path: Path, error: OSError) -> RecordingError:
    return RecordingError(
        f"The recording {path} cannot be written: {error.strerror or error}.",
        hint="Check the folder's permissions and the free space, or give another with --out.",
    )
