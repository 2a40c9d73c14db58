"""Readers of NumPy arrays and MATLAB files; pickled objects are refused."""

from __future__ import annotations

import importlib
import zipfile
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.channels import fill
from tactbench.core.recording.mapping.model import Arrays, Column, Mat, Npy
from tactbench.core.recording.mapping.table import ColumnTable, plain

Words = dict[str, str]


def read_arrays(path: Path, shown: str, how: Arrays, known: Words) -> Iterator[tuple[Words, ColumnTable]]:
    """Yield the table of each recording, with its words: ``index`` (from 0, with leading zeros) and `per_recording`.

    `known` are the words of the path, which are filled into the names of further files.

    Raises
    ------
    MappingError
        If the file has another format or lacks an array, or an array has the wrong shape or type.
    """
    names = {how.array, *how.per_recording.values()}
    if isinstance(how, Mat):
        # MATLAB has no vectors, and no axis of length 1 at the end: n values are (n, 1) or (1, n).
        arrays = {name: _shaped(values, len(how.axes) if name == how.array else 1)
                  for name, values in _load_mat(path, shown, names).items()}  # fmt: skip
    else:
        arrays = _load_numpy(path, shown, how, {name: fill(name, known, shown) for name in names})
    values = arrays[how.array]
    if values.ndim != len(how.axes):
        raise MappingError(
            f"{shown}: array {how.array!r} has {values.ndim} axes {values.shape}; the mapping names {len(how.axes)}: "
            f"{', '.join(how.axes)}.",
            hint="Name each axis: recording, row or channel.",
        )
    if values.dtype.kind not in "iufb":
        raise MappingError(f"{shown}: array {how.array!r} holds {values.dtype}, not numbers.", hint="Name another.")
    if values.size == 0:
        raise MappingError(f"{shown}: array {how.array!r} is empty.", hint="Name another array.")
    order = ("recording", "row", "channel")
    ordered = np.transpose(values, sorted(range(values.ndim), key=lambda axis: order.index(how.axes[axis])))
    lengths = [values.shape[how.axes.index(axis)] if axis in how.axes else 1 for axis in order[:2]]
    ordered = ordered.reshape(*lengths, -1)
    for word, name in how.per_recording.items():
        if arrays[name].shape != (len(ordered),):
            raise MappingError(
                f"{shown}: array {name!r} for {word!r} has shape {arrays[name].shape}, not ({len(ordered)},).",
                hint="It must hold one value a recording.",
            )
    wide = len(str(len(ordered) - 1))
    for index, rows in enumerate(ordered):
        words = {word: plain(arrays[name][index].item()) for word, name in how.per_recording.items()}
        where = f"{shown}[{f'{how.array}, ' if how.array else ''}{index}]"
        columns: dict[Column, Any] = dict(enumerate(rows.T))
        yield {"index": f"{index:0{wide}d}", **words}, ColumnTable(where, tuple(columns), range(len(rows)), columns)


def _require_there(shown: str, names: set[str], there: Collection[str]) -> None:
    for name in sorted(names):
        if name not in there:
            hint = f"{did_you_mean(name, there)}It has: {', '.join(sorted(there))}."
            raise MappingError(f"{shown} has no array {name!r}.", hint=hint)


def _load_numpy(path: Path, shown: str, how: Arrays, names: dict[str, str]) -> dict[str, npt.NDArray[Any]]:
    try:
        if isinstance(how, Npy):
            return {name: _load_npy(path.parent / file if file else path) for name, file in names.items()}
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as archive:
            _require_there(shown, {*names}, archive.files)
            return {name: archive[name] for name in names}
    except MappingError:
        raise
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise MappingError(
            f"{shown} cannot be read as a NumPy {'array' if isinstance(how, Npy) else 'archive'}: {error}.",
            hint="Pickled objects are refused; store plain arrays with numpy.save or numpy.savez_compressed.",
        ) from error


def _load_npy(path: Path) -> npt.NDArray[Any]:
    with path.open("rb") as opened:
        return np.lib.format.read_array(opened, allow_pickle=False)


def _load_mat(path: Path, shown: str, names: set[str]) -> dict[str, npt.NDArray[Any]]:
    io: Any = importlib.import_module("scipy.io")
    try:
        _require_there(shown, names, [name for name, *_ in io.whosmat(path)])
        found = io.loadmat(path, variable_names=sorted(names))
    except MappingError:
        raise
    except Exception as error:  # whatever a damaged file makes of the library
        raise MappingError(
            f"{shown} cannot be read as a MATLAB file: {error}.", hint="Save it with -v7, or the table as CSV."
        ) from error
    return {name: found[name] for name in names}


def _shaped(values: npt.NDArray[Any], axes: int) -> npt.NDArray[Any]:
    if axes == 1 and values.ndim == 2 and 1 in values.shape:
        return values.reshape(-1)
    return values.reshape(values.shape + (1,) * (axes - values.ndim))
