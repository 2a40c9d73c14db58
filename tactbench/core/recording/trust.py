"""What is believed of a file from a stranger: plain arrays that it holds itself, of the types it states."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import FormatError

SEE = "See docs/format.md."
# Deflate cannot shrink anything to less than 1/1032 (RFC 1951: 258 bytes from two bits); the rest is slack.
_LARGEST_RATIO = 1100
_SLACK_BYTES = 2**20
_VALUES_PER_BYTE, _FEW_VALUES = 16, 2**24
"""Values that a file may hold for each of its bytes, or any number up to the second: they are float64 when computed
with. Eight-bit taxels at rest come to about ten, their quality included."""
_CHUNK_BYTES = 2**26
"""HDF5 reads whole chunks; ours are of 1024 rows."""
_UNCHECKED_BYTES = 2**18
"""Compressed chunks of fewer bytes cannot fill more than 270 MB, whatever they claim."""
_DEFLATE, _SHUFFLE = 1, 2
_FILTERS: tuple[list[int], ...] = ([], [_DEFLATE], [_SHUFFLE], [_SHUFFLE, _DEFLATE])
"""Which every HDF5 library has: no other is asked to run."""
_REFERENCE_BYTES = 16
"""Of a text of variable length in a dataset: its length (4, unsigned, little-endian) and where it lies."""

READ_FAILURES = (
    OSError, KeyError, IndexError, RuntimeError, ValueError, TypeError, AttributeError, OverflowError, MemoryError,
)  # fmt: skip
"""What h5py raises when the bytes of a file make no sense."""


def child(path: Path, group: Any, name: str) -> Any:
    """Return the item `name` of a group, or None if there is none.

    Raises
    ------
    FormatError
        If it is a link to elsewhere: a recording is whole in itself.
    """
    import h5py

    link = group.get(name, getlink=True)
    if link is None:
        return None
    if not isinstance(link, h5py.HardLink):
        raise FormatError(f"In {path}, {group.name}/{name} is a link to another place.", hint=SEE)
    return group[name]


def subgroup(path: Path, group: Any, name: str) -> Any:
    """Return the group `name` of a group, or None; FormatError if it is something else."""
    import h5py

    item = child(path, group, name)
    if item is not None and not isinstance(item, h5py.Group):
        raise FormatError(f"In {path}, {group.name}/{name} is not a group.", hint=SEE)
    return item


def numbers(path: Path, group: Any, name: str, kinds: str, dimensions: int, *, strict: bool) -> Any:
    """Return the dataset `name` of a group, or None, after looking at everything but its values.

    Parameters
    ----------
    kinds
        Letters of the NumPy kinds that are allowed.
    strict
        Also refuse a dataset that claims more bytes than the file can hold.

    Raises
    ------
    FormatError
        If it has another type or shape, or keeps its bytes in another file.
    """
    dataset = _dataset(path, group, name, strict=strict)
    if dataset is not None and (dataset.dtype.kind not in kinds or dataset.ndim != dimensions):
        raise FormatError(
            f"In {path}, {group.name}/{name} holds {dataset.dtype} in {dataset.ndim} dimensions.", hint=SEE
        )
    return dataset


def annotation(path: Path, group: Any, name: str, *, strict: bool) -> Any:
    """Return the annotation `name` of a group: UTF-8 texts or whole numbers, one a row."""
    import h5py

    dataset = _dataset(path, group, name, strict=strict)
    text = dataset is not None and h5py.check_string_dtype(dataset.dtype) is not None
    if dataset is None or dataset.ndim != 1 or not (text or dataset.dtype.kind in "iu"):
        what = "nothing" if dataset is None else f"{dataset.dtype} in {dataset.ndim} dimensions"
        raise FormatError(
            f"In {path}, the annotation {name!r} holds {what}; only text and whole numbers are read.", hint=SEE
        )
    if strict and text and h5py.check_string_dtype(dataset.dtype).length is None:
        _look_at_texts(path, dataset)
    return dataset


def labels_of(dataset: Any, rows: slice) -> npt.NDArray[Any]:
    """Read rows of an annotation."""
    import h5py

    if h5py.check_string_dtype(dataset.dtype) is not None:
        return np.array(dataset.asstr("utf-8")[rows], dtype=np.str_)
    return np.asarray(dataset[rows], dtype=np.int64)


def _dataset(path: Path, group: Any, name: str, *, strict: bool) -> Any:
    import h5py

    item = child(path, group, name)
    if item is None:
        return None
    if not isinstance(item, h5py.Dataset):
        raise FormatError(f"In {path}, {group.name}/{name} is not a dataset.", hint=SEE)
    if item.is_virtual or item.external:
        raise FormatError(f"In {path}, {group.name}/{name} keeps its values in another file.", hint=SEE)
    if strict:
        _look_at_size(path, item)
    return item


def _look_at_size(path: Path, dataset: Any) -> None:
    """Refuse a dataset that takes more memory than a file like this can mean, before any of it is read."""
    name, claimed, held = dataset.name, dataset.size * dataset.dtype.itemsize, dataset.id.get_storage_size()
    if claimed > _LARGEST_RATIO * held + _SLACK_BYTES:
        raise FormatError(
            f"In {path}, {name} claims {claimed} bytes and holds {held}: it was cut short or made up.", hint=SEE
        )
    most = max(_FEW_VALUES, _VALUES_PER_BYTE * dataset.file.id.get_filesize())
    if dataset.size > most:
        raise FormatError(
            f"In {path}, {name} claims {dataset.size} values; a file of this size has at most {most}.",
            hint="Record in pieces if these are real data: one recording a press.",
        )
    if dataset.chunks is None:
        return
    chunk = int(np.prod(dataset.chunks)) * dataset.dtype.itemsize
    filters = _filters(dataset)
    if chunk > _CHUNK_BYTES or filters not in _FILTERS:
        what = f"filters {filters}" if chunk <= _CHUNK_BYTES else f"chunks of {chunk} bytes"
        raise FormatError(f"In {path}, {name} has {what}, which no recording has.", hint=SEE)
    if _DEFLATE in filters and dataset.dtype.kind != "O":  # of texts every chunk is looked at, by its own size
        large: list[Any] = []
        dataset.id.chunk_iter(lambda info: large.append(info) if info.size > _UNCHECKED_BYTES else None)
        for info in large:
            _inflated(path, dataset, info, chunk)


def _filters(dataset: Any) -> list[int]:
    stored = dataset.id.get_create_plist()
    return [stored.get_filter(place)[0] for place in range(stored.get_nfilters())]


def _inflated(path: Path, dataset: Any, info: Any, size: int) -> bytes:
    """Return a compressed chunk of `size` bytes; HDF5 itself would inflate whatever the chunk holds."""
    mask, stored = dataset.id.read_direct_chunk(info.chunk_offset)
    filters = [one for place, one in enumerate(_filters(dataset)) if not mask >> place & 1]
    if _DEFLATE in filters:
        try:
            stored = zlib.decompressobj().decompress(stored, size + 1)
        except zlib.error as error:
            raise FormatError(f"In {path}, {dataset.name} is damaged: {error}.", hint=SEE) from error
    if len(stored) != size:
        raise FormatError(f"In {path}, a chunk of {dataset.name} does not hold what it claims.", hint=SEE)
    return bytes(stored)


def _look_at_texts(path: Path, dataset: Any) -> None:
    """Refuse texts that are longer than the file can mean: many may refer to one long text in its heap.

    The heap is not compressed, and no writer lets texts share a place in it: together they are no longer than the file.
    """
    if dataset.chunks is None or _SHUFFLE in _filters(dataset):
        raise FormatError(f"In {path}, {dataset.name} is not stored in plain or deflated chunks.", hint=SEE)
    size = int(np.prod(dataset.chunks)) * _REFERENCE_BYTES
    chunks: list[Any] = []
    dataset.id.chunk_iter(chunks.append)
    total = longest = 0
    for info in chunks:
        references = np.frombuffer(_inflated(path, dataset, info, size), dtype="<u4")
        lengths = references[:: _REFERENCE_BYTES // 4].astype(np.int64)
        total += int(lengths.sum())
        longest = max(longest, int(lengths.max(initial=0)))
    held = dataset.file.id.get_filesize()
    if total > held or dataset.size * longest > max(_FEW_VALUES, _VALUES_PER_BYTE * held):
        raise FormatError(
            f"In {path}, {dataset.name} claims texts of {total} bytes, the longest of {longest}.", hint=SEE
        )
