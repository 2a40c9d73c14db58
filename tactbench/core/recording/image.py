"""The HDF5 file of a recording: compressed, and described so that ordinary viewers plot it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import UnwritableError
from tactbench.core.recording import format as layout
from tactbench.core.recording.clock_fit import on_host_clock
from tactbench.core.recording.partial import Annotations, Blocks, Columns
from tactbench.core.recording.reader import Recording, open_recording
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


def store(
    target: Path,
    meta: RecordingMeta,
    text: str,
    blocks: Blocks,
    annotations: Annotations,
    *,
    aside: Path,
    replace: bool,
) -> str:
    """Write a recording beside its place, read it back, and rename it to `target`; return its content digest.

    Memory is bounded by some chunks of each stream, whatever the length of the recording.

    Parameters
    ----------
    meta, text
        What the recording says about itself, its clock fits included, and the same as text.
    blocks
        As they came; their times are put on the host's clock here.
    aside
        Where the file is written until it has been read back.
    replace
        Whether `target` may be there already.

    Raises
    ------
    RecordingError
        If `target` exists and is not to be replaced, what was written reads otherwise, or the disk refuses; `target`
        is as it was.
    """
    try:
        with _Disk(aside, "w+") as disk:
            try:
                with build(disk, meta, text, blocks, annotations) as file:
                    file.attrs["content_sha256"] = Recording(aside, file, text, complete=True).content_digest()
                    file.attrs["complete"] = True
            finally:
                disk.check()
            os.fsync(disk.fileno())
        with open_recording(aside) as written:
            digest = written.verify()
        if not replace:
            require_free(target)
        aside.replace(target)
        _sync_folder(target.parent)
    except OSError as error:
        raise cannot_write(target, error) from error
    finally:
        with suppress(OSError):
            aside.unlink(missing_ok=True)
    return digest


def require_free(path: Path) -> None:
    """Raise UnwritableError if there is a recording already."""
    if path.exists():
        raise UnwritableError(f"{path} exists already.", hint="Give another name with --out, or delete that one.")


def cannot_write(path: Path, error: OSError) -> UnwritableError:
    """Return the error to raise when the disk refuses."""
    reason = error.strerror or error
    return UnwritableError(
        f"The recording {path} cannot be written: {reason}.",
        hint="Check the folder's permissions and the free space, or give another with --out.",
    )


class _Disk(FileIO):
    """A file that HDF5 writes through. It keeps the first error of the disk to itself until `check` raises it.

    HDF5 cannot give up a file on a full disk: closing it crashes the process.
    """

    error: OSError | None = None

    def write(self, content: Any) -> int:
        """Write all of `content`, or nothing more once the disk has refused something."""
        left = memoryview(content)
        try:
            while left and self.error is None:
                left = left[super().write(left) :]
        except OSError as error:
            self.error = error
        return len(content)

    def truncate(self, size: int | None = None) -> int:
        """Set the length."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0

    def check(self) -> None:
        """Raise the first error of the disk."""
        if self.error is not None:
            raise self.error


def build(memory: Any, meta: RecordingMeta, text: str, blocks: Blocks, annotations: Annotations) -> Any:
    """Return an open HDF5 file, written into the binary file `memory`, that holds all blocks; see `store`.

    It is not marked as complete.
    """
    import h5py

    # The oldest format that HDF5 still writes: every HDF5 reader in the world opens it.
    file = h5py.File(memory, "w", libver="earliest")
    try:
        _fill(file, meta, text, blocks, annotations)
    except BaseException:
        file.close()
        raise
    return file


def _fill(file: Any, meta: RecordingMeta, text: str, blocks: Blocks, annotations: Annotations) -> None:
    import h5py

    file.attrs["format"] = layout.FORMAT
    file.attrs["format_version"] = layout.VERSION
    file.attrs["complete"] = False
    file.attrs["NX_class"] = "NXroot"
    # Of variable length: one of fixed length would stop at 64 KiB, about forty channels.
    file.attrs.create("meta", text, dtype=h5py.string_dtype("utf-8"))
    streams = file.create_group("streams")
    streams.attrs["NX_class"] = "NXentry"
    specs = layout.specs_by_name(meta)
    for name, columns in _gathered(on_host_clock(meta, blocks)):
        _extend(streams.require_group(name), columns)
    for name in streams:
        _annotate(streams[name], annotations.get(name, {}))
        _describe(streams[name], specs[name])


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there
        return
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _gathered(blocks: Blocks) -> Iterator[tuple[str, Columns]]:
    """Yield larger blocks, of whole chunks but for each stream's last: a chunk is then compressed once."""
    waiting: dict[str, list[Columns]] = {}
    rows: dict[str, int] = {}
    for stream, columns in blocks:
        waiting.setdefault(stream, []).append(columns)
        rows[stream] = rows.get(stream, 0) + len(columns["data"])
        if rows[stream] >= layout.piece_rows(columns["data"].shape[1]):
            joined, whole = _joined(waiting[stream]), rows[stream] // layout.CHUNK_ROWS * layout.CHUNK_ROWS
            yield stream, {name: values[:whole] for name, values in joined.items()}
            waiting[stream], rows[stream] = (
                [{name: values[whole:] for name, values in joined.items()}],
                rows[stream] - whole,
            )
    for stream, some in waiting.items():
        yield stream, _joined(some)


def _joined(blocks: list[Columns]) -> Columns:
    joined = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0] if name != "quality"}
    if any("quality" in block for block in blocks):
        good = [block.get("quality", np.zeros(block["data"].shape, dtype=np.uint8)) for block in blocks]
        joined["quality"] = np.concatenate(good)
    return joined


def _extend(group: Any, columns: Columns) -> None:
    start = group["data"].shape[0] if "data" in group else 0
    stop = start + len(columns["data"])
    if "quality" in group and "quality" not in columns:
        columns["quality"] = np.zeros(columns["data"].shape, dtype=np.uint8)
    for name, values in columns.items():
        if name not in group:
            _create(group, name, values, start)
        group[name].resize(stop, axis=0)
        group[name][start:stop] = values


def _create(group: Any, name: str, values: npt.NDArray[Any], rows: int) -> None:
    """Make a column; quality may come late, and the zeros before it mean good."""
    rest = values.shape[1:]
    group.create_dataset(
        name, shape=(rows, *rest), maxshape=(None, *rest), dtype=values.dtype, chunks=(layout.CHUNK_ROWS, *rest),
        compression="gzip", compression_opts=4, shuffle=True, fillvalue=0,
    )  # fmt: skip


def _annotate(group: Any, annotations: Mapping[str, npt.NDArray[Any]]) -> None:
    import h5py

    for name, column in annotations.items():
        notes = group.require_group("annotations")
        if column.dtype.kind == "U":
            texts = column.tolist()
            notes.create_dataset(name, data=texts, dtype=h5py.string_dtype("utf-8"), compression="gzip")
        else:
            notes.create_dataset(name, data=column.astype(np.int64), compression="gzip", shuffle=True)


def _describe(group: Any, spec: StreamSpec) -> None:
    """Write what ordinary viewers need (NeXus: signal, axes, units)."""
    group.attrs["NX_class"] = "NXdata"
    group.attrs["signal"] = "data"
    if spec.rate_hz is not None:
        group.attrs["rate_hz"] = spec.rate_hz
    if "t_ns" in group:
        group.attrs["axes"] = ["t_ns", "."]
    for name in ("t_ns", "device_ns", "host_ns"):
        if name in group:
            group[name].attrs["units"] = "ns"
    units = {channel.unit for channel in spec.channels}
    group["data"].attrs["units"] = units.pop() if len(units) == 1 else "mixed: see channel_units"
    for name, values in layout.channel_attributes(spec):
        group.attrs[name] = values
    _attach_scales(group, spec)


def _attach_scales(group: Any, spec: StreamSpec) -> None:
    """Make times (rows, where there is no clock) and names of channels the HDF5 dimension scales of every column.

    Libraries of the netCDF world then read a stream with its coordinates.
    """
    import h5py

    columns = [*(group[name] for name in group if name != "annotations"), *group.get("annotations", {}).values()]
    rows = "t_ns" if "t_ns" in group else layout.ROWS
    if rows not in group:
        numbers = np.arange(len(group["data"]), dtype=np.int64)
        _create(group, rows, numbers, len(numbers))
        group[rows][:] = numbers
    names = [channel.name for channel in spec.channels]
    group.create_dataset(layout.CHANNELS, data=names, dtype=h5py.string_dtype("utf-8")).make_scale(layout.CHANNELS)
    group[rows].make_scale(rows)
    for column in columns:
        if column != group[rows]:
            column.dims[0].attach_scale(group[rows])
        if column.ndim == 2:
            column.dims[1].attach_scale(group[layout.CHANNELS])
