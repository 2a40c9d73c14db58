"""Merging of result folders of several machines.

The result is the union of the folders' cells, by name. Of two of one name

- finished counts more than not finished; of two that did not finish, the one whose status stands first in
  `tactbench.core.spec.row.STATUSES` is kept, then the one of the host with the smaller id;
- two finished ones are equal if configuration, versions and source are, and what a seed decides agrees to a relative
  1e-9: one that was timed, then the one of the host with the smaller id is kept, whole, so that times of two hosts are
  not mixed;
- anything else is a contradiction: nothing is written.

Recordings of one name are taken from the folder whose cells are kept.
"""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactbench.core.errors import FolderError
from tactbench.core.matrix.keys import differences
from tactbench.core.matrix.store import Row, Store, writing
from tactbench.core.spec.row import STATUSES

SAME_SCORE = 1e-9
"""Relative difference of scores of the same cell on two kinds of processor: they add millions of terms in another
order."""
_SHOWN = 10
"""Number of contradictions that a message lists."""
_DECIDES = ("configuration", "task", "estimator", "versions", "source")
"""Sections of a key that two results of one name must share."""

SEED_DECIDES = (
    "cell", "status", "metric", "score", "ci_low", "ci_high", "ci_method", "reference_floor",
    "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score", "tare_s", "n_recordings",
    "n_train", "n_test",
    "counts", "chosen", "scores", "confusion", "classes", "split", "stamps", "dagger",
)  # fmt: skip
"""Keys of a row that depend on configuration and seed alone, except for the last bits of numbers."""


@dataclass(frozen=True)
class Merged:
    """Summary of a merge."""

    rows: tuple[Row, ...]
    recordings: int
    left_out: tuple[str, ...]
    """Sentences about cells that could not be read."""


def merge(folders: Sequence[Path], out: Path, *, also: Callable[[Path], None] | None = None) -> Merged:
    """Merge `folders` into the new folder `out`, which does not remain if that fails.

    Parameters
    ----------
    folders
        Result folders; they are only read.
    out
        A folder that does not exist yet.
    also
        Function that writes further files into the new folder, before that gets its name.

    Raises
    ------
    FolderError
        If a folder holds no results, two contradict each other, or `out` exists or cannot be written.
    """
    if os.path.lexists(out):
        raise FolderError(f"{out} exists already.", hint="Give --out a folder that does not; merging changes none.")
    kept: dict[str, tuple[Row, Store]] = {}
    against: list[str] = []
    left_out: list[str] = []
    for store in map(Store, folders):
        rows = store.rows()
        left_out += [f"{store.folder}: {trouble}" for trouble in store.troubles]
        if not rows:
            troubles = f" ({'; '.join(store.troubles)})" if store.troubles else ""
            raise FolderError(f"There are no results in {store.folder}{troubles}.", hint="Name what `run --out` wrote.")
        for row in rows:
            other = kept.setdefault(row["cell"], (row, store))
            if "done" == row["status"] == other[0]["status"] and (found := _contradiction(other, (row, store))):
                against.append(f"{row['cell']} in {other[1].folder} and in {store.folder}: {found}")
            kept[row["cell"]] = min(other, (row, store), key=_precedence)
    if against:
        more = f"; and {len(against) - _SHOWN} more" if len(against) > _SHOWN else ""
        raise FolderError(
            f"The folders contradict each other: {'; '.join(against[:_SHOWN])}{more}.",
            hint="Nothing was written. Leave one of them out, or run the named cells again with the same version.",
        )
    with writing(out):
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".merging-", dir=out.absolute().parent) as place:
            aside = Path(place) / out.name
            for part in ("cells", "recordings"):
                (aside / part).mkdir(parents=True)
            recordings: set[str] = set()
            for row, store in kept.values():
                shutil.copyfile(store.file_of(row), aside / "cells" / store.file_of(row).name)
                for name, file in store.recordings(row):
                    if not Path(name).is_absolute() and file is not None and name not in recordings:
                        recordings.add(name)
                        _link(file, aside / file.relative_to(store.folder))
            if also is not None:
                also(aside)
            aside.rename(out)
    return Merged(tuple(row for row, _ in kept.values()), len(recordings), tuple(left_out))


def _precedence(one: tuple[Row, Store]) -> tuple[Any, ...]:
    """Return the sort key of a result: of results with one name the smallest is kept."""
    row, _ = one
    return STATUSES.index(row["status"]), row["latency_n"] is None, row["host"], row["key"]


def _contradiction(one: tuple[Row, Store], other: tuple[Row, Store]) -> str:
    """Return the inadmissible differences of two finished cells of one name, or an empty string."""
    first, second = ({name: store.cell(row).sections.get(name) for name in _DECIDES} for row, store in (one, other))
    for sections in (first, second):  # a run times its first replicate, which may be another's second
        sections["configuration"] = {**(sections["configuration"] or {}), "timed": None}
    old, new = ({name: row[name] for name in SEED_DECIDES} for row, _ in (one, other))
    return "; ".join((differences(first, second) or differences(old, new, same=_same))[:3])


def _same(one: Any, other: Any) -> bool:
    """Return whether two values of a row agree, numbers to a relative `SAME_SCORE`."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, int | float) and isinstance(other, int | float):
        return math.isclose(one, other, rel_tol=SAME_SCORE, abs_tol=1e-12)
    return bool(one == other)


def _link(path: Path, target: Path) -> None:
    """Link a recording, which never changes, to a second path; copy it where links are not supported."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(path, target)
    except OSError:
        shutil.copyfile(path, target)
