"""Writing a finished recording from its partial file: compressed, described, synced, and then put in place at once."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.recording import format as layout
from tactbench.core.recording.partial import Partial, envelope
from tactbench.core.recording.reader import Recording
from tactbench.core.spec.sensor import StreamSpec

Annotations = Mapping[str, npt.NDArray[Any]]


def write(path: Path, partial: Partial, text: str, specs: Mapping[str, StreamSpec],
          annotations: Mapping[str, Annotations]) -> None:  # fmt: skip
    """Write the whole recording to `path` and sync it; OSError or RuntimeError if the disk refuses."""
    import h5py

    # The oldest format that HDF5 still writes: every HDF5 reader in the world opens it.
    with h5py.File(path, "w", libver="earliest") as file:
        envelope(file, text, complete=False)
        for name in partial.begun:
            group = file["streams"].create_group(name)
            _copy(group, partial, name)
            _annotate(group, annotations.get(name, {}))
            _describe(group, specs[name])
        # Read back, not remembered: the digest is that of the stored bytes.
        file.attrs["content_sha256"] = Recording(path, file, text, complete=True).content_digest()
        file.attrs["complete"] = True
    with path.open("rb") as written:
        os.fsync(written.fileno())


def place(written: Path, target: Path) -> None:
    """Rename `written` to `target`, and make the folder remember it."""
    written.replace(target)
    folder = os.open(target.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _copy(group: Any, partial: Partial, stream: str) -> None:
    """Copy the columns; quality only if something is not good, for none means all good."""
    rows = partial.begun[stream]
    flagged = any("quality" in block and block["quality"].any() for block in partial.blocks(stream))
    start = 0
    for block in partial.blocks(stream):
        if not flagged:
            block.pop("quality", None)
        for name, values in block.items():
            if name not in group:
                _create(group, name, values, rows)
            group[name][start : start + len(values)] = values
        start += len(block["data"])


def _create(group: Any, name: str, values: npt.NDArray[Any], rows: int) -> None:
    rest = values.shape[1:]
    group.create_dataset(
        name, shape=(rows, *rest), maxshape=(None, *rest), dtype=values.dtype, chunks=(layout.CHUNK_ROWS, *rest),
        compression="gzip", compression_opts=4, shuffle=True,
    )  # fmt: skip


def _annotate(group: Any, annotations: Annotations) -> None:
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
        group["t_ns"].attrs["units"] = "ns"
    units = {channel.unit for channel in spec.channels}
    group["data"].attrs["units"] = units.pop() if len(units) == 1 else "mixed: see channel_units"
    for name, values in layout.channel_attributes(spec):
        group.attrs[name] = values
