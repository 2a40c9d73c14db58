"""Reading NumPy archives into tables; pickled objects are refused."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import MappingError, nearest
from tactbench.core.recording.mapping.model import Npz
from tactbench.core.recording.mapping.table import ArrayTable, plain

MAX_BYTES = 4 * 2**30
"""An archive that unpacks to more is refused: a small file can claim any size."""

Words = dict[str, str]


def read_npz(path: Path, shown: str, how: Npz) -> Iterator[tuple[Words, ArrayTable]]:
    """Yield one table a recording, with its words: ``index`` (from 0, with leading zeros) and `per_recording`.

    Raises
    ------
    MappingError
        If the file is no archive, lacks an array, or an array has the wrong shape or type.
    """
    arrays = _load(path, shown, {how.array, *how.per_recording.values()})
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
    present = [axis for axis in ("recording", "row", "channel") if axis in how.axes]
    ordered = np.transpose(values, [how.axes.index(axis) for axis in present])
    shape = dict(zip(present, ordered.shape, strict=True))
    ordered = ordered.reshape(tuple(shape.get(axis, 1) for axis in ("recording", "row", "channel")))
    for word, name in how.per_recording.items():
        if arrays[name].shape != (len(ordered),):
            raise MappingError(
                f"{shown}: array {name!r} for {word!r} has shape {arrays[name].shape}, not ({len(ordered)},).",
                hint="It must hold one value a recording.",
            )
    wide = len(str(len(ordered) - 1))
    for index, rows in enumerate(ordered):
        words = {word: plain(arrays[name][index].item()) for word, name in how.per_recording.items()}
        yield {"index": f"{index:0{wide}d}", **words}, ArrayTable(f"{shown}[{how.array}, {index}]", rows)


def _load(path: Path, shown: str, names: set[str]) -> dict[str, npt.NDArray[Any]]:
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > MAX_BYTES:
            raise MappingError(f"{shown} unpacks to {size} bytes; at most {MAX_BYTES} are read.", hint="Split it.")
        with np.load(path, allow_pickle=False) as archive:
            for name in sorted(names):
                if name not in archive.files:
                    close = nearest(name, archive.files)
                    meant = f"Did you mean {close[0]!r}? " if close else ""
                    raise MappingError(
                        f"{shown} has no array {name!r}.", hint=f"{meant}It has: {', '.join(sorted(archive.files))}."
                    )
            return {name: archive[name] for name in names}
    except MappingError:
        raise
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise MappingError(
            f"{shown} cannot be read as a NumPy archive: {error}.",
            hint="Pickled objects are refused; store plain arrays with numpy.savez_compressed.",
        ) from error
