"""What is believed of a file from a stranger: plain arrays that it holds itself, of the types it states."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import FormatError

SEE = "See docs/format.md."
# Deflate cannot shrink anything to less than 1/1032 (RFC 1951: 258 bytes from two bits); the rest is slack.
_LARGEST_RATIO = 1100
_SLACK_BYTES = 2**20

READ_FAILURES = (OSError, KeyError, RuntimeError, ValueError, TypeError, AttributeError)
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
    claimed, held = item.size * item.dtype.itemsize, item.id.get_storage_size()
    if strict and claimed > _LARGEST_RATIO * held + _SLACK_BYTES:
        raise FormatError(
            f"In {path}, {group.name}/{name} claims {claimed} bytes and holds {held}: it was cut short or made up.",
            hint=SEE,
        )
    return item
