"""Readers of NumPy arrays and MATLAB files; pickled objects are refused."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError, did_you_mean
from tactbench.core.recording.mapping.channels import fill
from tactbench.core.recording.mapping.model import Arrays, Column
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
    arrays = _load(
        path, shown, how, {name: fill(name, known, shown) for name in (how.array, *how.per_recording.values())}
    )
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


def _load(path: Path, shown: str, how: Arrays, names: dict[str, str]) -> dict[str, npt.NDArray[Any]]:
    """Return arrays by name; `names` are the same with words filled in, which `npy` needs."""
    try:
        with ExitStack() as stack:
            if how.format == "npy":
                opened = {name: path.parent / file if file else path for name, file in names.items()}
                return {name: np.lib.format.read_array(stack.enter_context(one.open("rb")), allow_pickle=False)
                        for name, one in opened.items()}  # fmt: skip
            if how.format == "mat":
                io: Any = importlib.import_module("scipy.io")
                there, archive = [name for name, *_ in io.whosmat(path)], io.loadmat(path, variable_names=[*names])
            else:
                archive = stack.enter_context(np.load(stack.enter_context(path.open("rb")), allow_pickle=False))
                there = archive.files
            for name in names:
                if name not in there:
                    hint = f"{did_you_mean(name, there)}It has: {', '.join(sorted(there))}."
                    raise MappingError(f"{shown} has no array {name!r}.", hint=hint)
            if how.format == "npz":
                return {name: archive[name] for name in names}
            return {name: _shaped(archive[name], len(how.axes) if name == how.array else 1) for name in names}
    except MappingError:
        raise
    except Exception as error:  # whatever a damaged file makes of the library
        raise MappingError(
            f"{shown} cannot be read as `format: {how.format}`: {error}.",
            hint="Store plain arrays with numpy.save, numpy.savez_compressed or, in MATLAB, with -v7; pickled objects "
            "are refused.",
        ) from error


def _shaped(values: npt.NDArray[Any], axes: int) -> npt.NDArray[Any]:
    """Return an array with so many axes; in MATLAB n values are (n, 1) or (1, n), and no last axis has length 1."""
    if axes == 1 and values.ndim == 2 and 1 in values.shape:
        return values.reshape(-1)
    return values.reshape(values.shape + (1,) * (axes - values.ndim))
