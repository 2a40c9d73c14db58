"""Creation and storing of a recording's HDF5 file, compressed, with attributes for ordinary HDF5 viewers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.errors import FormatError, UnwritableError
from tactbench.core.files import hdf5_image, replace_file, writable
from tactbench.core.recording import format as layout
from tactbench.core.recording.clock_fit import on_host_clock
from tactbench.core.recording.format import Annotations, Array, Blocks, Columns
from tactbench.core.recording.reader import content_digest
from tactbench.core.samples import IntArray
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec


def store(
    target: Path,
    meta: RecordingMeta,
    blocks: Blocks,
    annotations: Annotations,
    *,
    aside: Path,
    replace: bool = False,
    sync: bool = True,
) -> RecordingMeta:
    """Write a recording to the temporary path `aside`, check it by reading it back, and rename it to `target`.

    Memory holds the compressed file, some chunks of each stream, and the times of streams with a device clock. `blocks`
    are in the order of receipt, and are iterated twice; the device's times are converted to the host's clock. With
    `sync`, the disk has stored the file when the function returns; False suits recordings that can be made again.

    Return `meta` with the clock fits of devices. Raises RecordingError if `target` exists and `replace` is False, the
    file read back differs from the data, or the disk refuses to write; `target` stays unchanged.
    """

    def check(written: Path) -> None:
        try:
            content_digest(written)
        except FormatError as error:
            raise UnwritableError(
                f"The data of {target}, read back, differ from the data written.", hint="Check the disk."
            ) from error
        if not replace:
            require_free(target)

    with writable(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        stamps: dict[str, list[Array]] = {}
        flagged = set()
        for stream, columns in blocks:
            flagged |= {stream} if "quality" in columns else set()
            if "device_ns" in columns:
                stamps.setdefault(stream, []).append(np.stack((columns["device_ns"], columns["t_ns"])))
        meta, times = on_host_clock(meta, {name: np.concatenate(some, axis=1) for name, some in stamps.items()})
        image = hdf5_image(lambda file: _fill(file, meta, _completed(blocks, times, flagged), annotations))
        replace_file(target, image, aside=aside, check=check, sync=sync)
    return meta


def require_free(path: Path) -> None:
    """Raise UnwritableError if there is already a file at `path`."""
    if path.exists():
        raise UnwritableError(f"{path} exists already.", hint="Give another name with --out, or delete the file.")


def _fill(file: Any, meta: RecordingMeta, blocks: Blocks, annotations: Annotations) -> None:
    """Write a recording into an open HDF5 file, with the digest of the data before HDF5 stores them."""
    import h5py

    text = layout.meta_text(meta)
    file.attrs.update(format=layout.FORMAT, format_version=layout.VERSION, complete=True, NX_class="NXroot")
    # Of variable length: one of fixed length would stop at 64 KiB, about forty channels.
    file.attrs.create("meta", text, dtype=h5py.string_dtype("utf-8"))
    streams = file.create_group("streams")
    streams.attrs["NX_class"] = "NXentry"
    specs = layout.specs_by_name(meta)
    digest = layout.ContentDigest(text)
    for name, columns in _gathered(blocks):
        for part, values in columns.items():
            digest.add(f"/{name}/{part}", values)
            _extend(streams.require_group(name), part, values)
    for name in streams:
        for label, column in annotations.get(name, {}).items():
            kept = column if column.dtype.kind == "U" else column.astype(np.int64)
            digest.add(f"/{name}/annotations/{label}", kept)
            _annotate(streams[name], label, kept)
        _describe(streams[name], specs[name])
    file.attrs["content_sha256"] = digest.hexdigest()


def _completed(blocks: Blocks, times: dict[str, IntArray], flagged: set[str]) -> Iterator[tuple[str, Columns]]:
    """Yield `blocks` with `times` on the host's clock, by stream, and with quality in every block of `flagged` streams.

    Beside times on the host's clock, ``host_ns`` are the times of receipt.
    """
    rows: Counter[str] = Counter()
    for stream, columns in blocks:
        first, count = rows[stream], len(columns["data"])
        rows[stream] += count
        if stream in times:
            columns = {**columns, "host_ns": columns["t_ns"], "t_ns": times[stream][first : first + count]}
        if stream in flagged:
            columns = {"quality": np.zeros_like(columns["data"], dtype=np.uint8), **columns}
        yield stream, columns


def _gathered(blocks: Blocks) -> Iterator[tuple[str, Columns]]:
    """Yield larger blocks, as each write takes HDF5 some time."""
    waiting: dict[str, list[Columns]] = {}
    rows: Counter[str] = Counter()
    for stream, columns in blocks:
        waiting.setdefault(stream, []).append(columns)
        rows[stream] += len(columns["data"])
        if rows[stream] >= layout.piece_rows(columns["data"].shape[1]):
            yield stream, _joined(waiting.pop(stream))
            del rows[stream]
    yield from ((stream, _joined(some)) for stream, some in waiting.items())


def _joined(blocks: list[Columns]) -> Columns:
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def _extend(group: Any, name: str, values: Array) -> Any:
    """Append `values` to a column, which is created at its first values, and return the column."""
    if name not in group:
        rest = values.shape[1:]
        group.create_dataset(
            name, shape=(0, *rest), maxshape=(None, *rest), dtype=values.dtype, compression="gzip",
            compression_opts=4, shuffle=True, fillvalue=0, chunks=(layout.CHUNK_ROWS, *rest),
        )  # fmt: skip
    column = group[name]
    start = column.shape[0]
    column.resize(start + len(values), axis=0)
    column[start:] = values
    return column


def _annotate(group: Any, label: str, column: Array) -> None:
    import h5py

    notes = group.require_group("annotations")
    if column.dtype.kind == "U":
        notes.create_dataset(label, data=column.tolist(), dtype=h5py.string_dtype("utf-8"), compression="gzip")
    else:
        notes.create_dataset(label, data=column, compression="gzip", shuffle=True)


def _describe(group: Any, spec: StreamSpec) -> None:
    """Write the attributes with which ordinary HDF5 viewers plot a stream (NeXus: signal, axes, units)."""
    columns = {name: column for name, column in group.items() if name != "annotations"}
    group.attrs.update(NX_class="NXdata", signal="data", **({"axes": ["t_ns", "."]} if "t_ns" in columns else {}))
    for name in columns.keys() & {"t_ns", "device_ns", "host_ns"}:
        columns[name].attrs["units"] = "ns"
    units = {channel.unit for channel in spec.channels}
    columns["data"].attrs["units"] = units.pop() if len(units) == 1 else "mixed: see meta"
    _attach_scales(group, columns, [channel.name for channel in spec.channels])


def _attach_scales(group: Any, columns: dict[str, Any], names: list[str]) -> None:
    """Make the times (or row numbers, without a clock) and the channels' names the dimension scales of every column.

    Libraries for netCDF files can then read a stream with its coordinates.
    """
    import h5py

    rows = columns.get("t_ns")
    if rows is None:
        rows = _extend(group, layout.ROWS, np.arange(len(columns["data"]), dtype=np.int64))
    channels = group.create_dataset(layout.CHANNELS, data=names, dtype=h5py.string_dtype("utf-8"))
    channels.make_scale(layout.CHANNELS)
    rows.make_scale("t_ns" if "t_ns" in columns else layout.ROWS)
    for column in (*columns.values(), *group.get("annotations", {}).values()):
        if column != rows:
            column.dims[0].attach_scale(rows)
        if column.ndim == 2:
            column.dims[1].attach_scale(channels)
