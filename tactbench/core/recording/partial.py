"""A recording while it is being made: a file that can be read at every moment, also after ``kill -9``.

An ordinary HDF5 file cannot: between two flushes its chunks and their index may disagree, and a process killed there
leaves a file whose last chunks, or all of it, cannot be read. HDF5's SWMR mode orders its writes so that a reader
finds a consistent file whenever it looks. Its price: nothing can be created once it has begun, and compressed chunks
that grow leave holes. Therefore rows are kept uncompressed here, and the finished recording is written anew from them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.recording import format as layout
from tactbench.core.spec.sensor import StreamSpec

Columns = dict[str, npt.NDArray[Any]]
"""Columns of a stream by name: data (n, channels), t_ns (n,), quality (n, channels), sequence (n,)."""

COPY_ROWS = 65536
"""Rows held in memory while a finished recording is written."""


class Partial:
    """The file that grows.

    Parameters
    ----------
    path
        Where it lies while the recording is being made.
    text
        The meta as it is known now.
    specs
        All streams that may come.
    timed
        Whether streams have time stamps.
    """

    def __init__(self, path: Path, text: str, specs: Iterable[StreamSpec], *, timed: bool) -> None:
        import h5py

        self.path = path
        self.begun: dict[str, int] = {}
        """Rows of the streams that have had a block"""
        self._file: Any = h5py.File(path, "w", libver="v110")
        envelope(self._file, text, complete=False)
        streams = self._file["streams"]
        for spec in specs:
            group = streams.create_group(spec.name)
            wide = len(spec.channels)
            _empty(group, "data", (wide,), spec.dtype)
            _empty(group, "quality", (wide,), "uint8")
            _empty(group, "sequence", (), "int64")
            if timed:
                _empty(group, "t_ns", (), "int64")
        self._file.swmr_mode = True

    def append(self, stream: str, columns: Mapping[str, npt.NDArray[Any]]) -> None:
        """Add rows to the columns given, and flush them."""
        group = self._file["streams"][stream]
        start = self.begun.get(stream, 0)
        stop = start + len(columns["data"])
        for name, values in columns.items():
            dataset = group[name]
            dataset.resize(stop, axis=0)
            dataset[start:stop] = values
            dataset.flush()
        self.begun[stream] = stop

    def blocks(self, stream: str) -> Iterator[Columns]:
        """Yield all rows again, in large blocks."""
        group, rows = self._file["streams"][stream], self.begun[stream]
        names = [name for name in group if group[name].shape[0] == rows]
        for start in range(0, max(rows, 1), COPY_ROWS):
            yield {name: group[name][start : min(start + COPY_ROWS, rows)] for name in names}

    def close(self) -> None:
        """Close the file; it stays where it is."""
        self._file.close()


def envelope(file: Any, text: str, *, complete: bool) -> None:
    """Write what every file of the format begins with."""
    import h5py

    file.attrs["format"] = layout.FORMAT
    file.attrs["format_version"] = layout.VERSION
    file.attrs["complete"] = complete
    file.attrs["NX_class"] = "NXroot"
    # Of variable length: one of fixed length would stop at 64 KiB, about forty channels.
    file.attrs.create("meta", text, dtype=h5py.string_dtype("utf-8"))
    file.create_group("streams").attrs["NX_class"] = "NXentry"


def _empty(group: Any, name: str, rest: tuple[int, ...], dtype: Any) -> None:
    group.create_dataset(
        name, shape=(0, *rest), maxshape=(None, *rest), dtype=np.dtype(dtype), chunks=(layout.CHUNK_ROWS, *rest)
    )
