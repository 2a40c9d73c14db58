"""The HDF5 file of a recording, built in memory: compressed, and described so that ordinary viewers plot it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.recording import format as layout
from tactbench.core.recording.partial import Annotations, Columns
from tactbench.core.recording.times import on_host_clock
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec

COPY_ROWS = 16384
"""Rows gathered before they are compressed: one row at a time would take a tenth of a millisecond each."""


def build(
    memory: BytesIO,
    meta: RecordingMeta,
    text: str,
    blocks: Iterable[tuple[str, Columns]],
    annotations: Annotations,
) -> Any:
    """Return an open HDF5 file in memory that holds all blocks; it is not marked as complete.

    Parameters
    ----------
    memory
        Empty; what the file is built in.
    meta, text
        What the recording says about itself, its clock fits included, and the same as text.
    blocks
        As they came; their times are put on the host's clock here.

    Notes
    -----
    In memory, because HDF5 cannot give up a file on a disk that turns out to be full without crashing the process.
    It needs as much memory as the compressed recording.
    """
    import h5py

    # The oldest format that HDF5 still writes: every HDF5 reader in the world opens it.
    file = h5py.File(memory, "w", libver="earliest")
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
    return file


def store(memory: BytesIO, file: Any, digest: str, target: Path) -> None:
    """Mark a file built in memory as complete, and put it at `target` at once: synced first, then renamed.

    Raises
    ------
    OSError
        If the disk refuses; `target` is as it was.
    """
    file.attrs["content_sha256"] = digest
    file.attrs["complete"] = True
    file.flush()
    completing = layout.completing_path(target)
    try:
        with completing.open("wb") as written, memory.getbuffer() as content:
            written.write(content)
            written.flush()
            os.fsync(written.fileno())
        completing.replace(target)
    finally:
        completing.unlink(missing_ok=True)
    _sync_folder(target.parent)


def _sync_folder(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _gathered(blocks: Iterable[tuple[str, Columns]]) -> Iterator[tuple[str, Columns]]:
    """Yield fewer and larger blocks."""
    waiting: dict[str, list[Columns]] = {}
    rows: dict[str, int] = {}
    for stream, columns in blocks:
        waiting.setdefault(stream, []).append(columns)
        rows[stream] = rows.get(stream, 0) + len(columns["data"])
        if rows[stream] >= COPY_ROWS:
            yield stream, _joined(waiting.pop(stream))
            rows[stream] = 0
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
    # Written, although they are the fill value: a dataset that claims more than it can hold is taken for one cut short.
    for start in range(0, rows, COPY_ROWS):
        stop = min(start + COPY_ROWS, rows)
        group[name][start:stop] = np.zeros((stop - start, *rest), dtype=values.dtype)


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
