"""The HDF5 file of a recording: compressed, and described so that ordinary viewers plot it."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import FormatError, UnwritableError
from tactbench.core.files import hdf5_image
from tactbench.core.recording import format as layout
from tactbench.core.recording.clock_fit import on_host_clock
from tactbench.core.recording.partial import Annotations, Blocks, Columns
from tactbench.core.recording.reader import open_recording
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

    Of the recording, memory holds the compressed file and some chunks of each stream.

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
        image = build(meta, text, blocks, annotations, complete=True)
        with aside.open("wb") as file:
            file.write(image)
            file.flush()
            os.fsync(file.fileno())
        try:
            with open_recording(aside) as written:
                digest = written.verify()
        except FormatError as error:
            raise UnwritableError(
                f"What is read back of {target} is not what was written.", hint="Did the disk fail?"
            ) from error
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


def build(meta: RecordingMeta, text: str, blocks: Blocks, annotations: Annotations, *, complete: bool) -> bytes:
    """Return the HDF5 file that holds all blocks; see `store`. Its digest is of the blocks, before HDF5 has them."""
    return hdf5_image(lambda file: _fill(file, meta, text, blocks, annotations, complete=complete))


def _fill(
    file: Any, meta: RecordingMeta, text: str, blocks: Blocks, annotations: Annotations, *, complete: bool
) -> None:
    import h5py

    file.attrs["format"] = layout.FORMAT
    file.attrs["format_version"] = layout.VERSION
    file.attrs["complete"] = complete
    file.attrs["NX_class"] = "NXroot"
    # Of variable length: one of fixed length would stop at 64 KiB, about forty channels.
    file.attrs.create("meta", text, dtype=h5py.string_dtype("utf-8"))
    streams = file.create_group("streams")
    streams.attrs["NX_class"] = "NXentry"
    specs = layout.specs_by_name(meta)
    digest = layout.ContentDigest(text)
    for name, columns in _gathered(_digested(on_host_clock(meta, blocks), digest)):
        _extend(streams.require_group(name), columns)
    for name in streams:
        for label, column in annotations.get(name, {}).items():
            kept = column if column.dtype.kind == "U" else column.astype(np.int64)
            digest.add(f"/{name}/annotations/{label}", kept)
            _annotate(streams[name], label, kept)
        _describe(streams[name], specs[name])
    file.attrs["content_sha256"] = digest.hexdigest()


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there
        return
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _digested(blocks: Blocks, digest: layout.ContentDigest) -> Iterator[tuple[str, Columns]]:
    """Yield blocks with quality from the first block on that has some, and add them to the digest."""
    rows: Counter[str] = Counter()
    flagged = set()
    for stream, columns in blocks:
        shape = columns["data"].shape
        if "quality" in columns and stream not in flagged:  # all rows before it are good
            flagged.add(stream)
            digest.add(f"/{stream}/quality", np.zeros((rows[stream], shape[1]), dtype=np.uint8))
        elif stream in flagged:
            columns = {"quality": np.zeros(shape, dtype=np.uint8), **columns}
        rows[stream] += len(columns["data"])
        for name, values in columns.items():
            digest.add(f"/{stream}/{name}", values)
        yield stream, columns


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


def _annotate(group: Any, label: str, column: npt.NDArray[Any]) -> None:
    import h5py

    notes = group.require_group("annotations")
    if column.dtype.kind == "U":
        notes.create_dataset(label, data=column.tolist(), dtype=h5py.string_dtype("utf-8"), compression="gzip")
    else:
        notes.create_dataset(label, data=column, compression="gzip", shuffle=True)


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
