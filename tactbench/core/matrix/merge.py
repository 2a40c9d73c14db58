"""Merging of result folders of several machines.

The result is the union of the folders' cells. Of two cells with one name

- a finished one is kept rather than an unfinished one; of two unfinished cells, the one whose status is first in
  `tactbench.core.spec.row.STATUSES` is kept, then the one of the host with the smaller id;
- two finished ones are equal if configuration, versions and source are, and seeded values agree to a relative
  1e-9: a timed one, then the one of the host with the smaller id is kept as a whole, so that times of two hosts are
  not mixed;
- all other pairs are contradictions, and nothing is written.

Recordings with one name are taken from the folder whose cells are kept.
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
"""Largest relative difference of scores of one cell on two kinds of processor, which add millions of terms in another
order."""
_SHOWN = 10
"""Largest number of contradictions listed in a message."""
_DECIDES = ("configuration", "task", "estimator", "versions", "source")
"""Sections of a key that must be equal for two results with the same name."""

SEED_DECIDES = (
    "cell", "status", "metric", "score", "ci_low", "ci_high", "ci_method", "reference_floor",
    "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score", "tare_s", "n_recordings",
    "n_train", "n_test",
    "counts", "chosen", "scores", "confusion", "classes", "split", "stamps", "dagger",
)  # fmt: skip
"""Keys of a row with values that depend on configuration and seed alone, except for the last bits of numbers."""


@dataclass(frozen=True)
class Merged:
    """Summary of a merge: rows, number of recordings, and files left out."""

    rows: tuple[Row, ...]
    recordings: int
    left_out: tuple[str, ...]
    """One sentence for each file of a cell that could not be read."""


def merge(folders: Sequence[Path], out: Path, *, also: Callable[[Path], None] | None = None) -> Merged:
    """Merge result folders into the new folder `out`, which is not created if merging fails.

    Parameters
    ----------
    folders
        Result folders, which are not changed.
    out
        Path of a folder that does not exist yet.
    also
        Function that writes further files into the new folder, called before the folder is renamed to `out`.

    Raises
    ------
    FolderError
        If a folder contains no results, two folders contradict each other, or `out` exists or cannot be written.
    """
    if os.path.lexists(out):
        raise FolderError(f"{out} exists already.", hint="Give --out a folder that does not exist yet.")
    kept: dict[str, tuple[Row, Store]] = {}
    against: list[str] = []
    left_out: list[str] = []
    for store in map(Store, folders):
        rows = store.rows()
        left_out += [f"{store.folder}: {trouble}" for trouble in store.troubles]
        if not rows:
            troubles = f" ({'; '.join(store.troubles)})" if store.troubles else ""
            raise FolderError(f"There are no results in {store.folder}{troubles}.", hint="Give folders of `run --out`.")
        for row in rows:
            other = kept.setdefault(row["cell"], (row, store))
            if "done" == row["status"] == other[0]["status"] and (found := _contradiction(other, (row, store))):
                against.append(f"{row['cell']} in {other[1].folder} and in {store.folder}: {found}")
            kept[row["cell"]] = min(other, (row, store), key=_precedence)
    if against:
        more = f"; and {len(against) - _SHOWN} more" if len(against) > _SHOWN else ""
        raise FolderError(
            f"The folders contradict each other: {'; '.join(against[:_SHOWN])}{more}.",
            hint="Nothing was written. Leave out one folder, or run the listed cells again with the same version.",
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
    """Return the sort key of a result; of results with the same name, the smallest is kept."""
    row, _ = one
    return STATUSES.index(row["status"]), row["latency_n"] is None, row["host"], row["key"]


def _contradiction(one: tuple[Row, Store], other: tuple[Row, Store]) -> str:
    """Return the inadmissible differences of two finished cells with the same name, or an empty string."""
    first, second = ({name: store.cell(row).sections.get(name) for name in _DECIDES} for row, store in (one, other))
    for sections in (first, second):  # a run times its first replicate, which may be another's second
        sections["configuration"] = {**(sections["configuration"] or {}), "timed": None}
    old, new = ({name: row[name] for name in SEED_DECIDES} for row, _ in (one, other))
    return "; ".join((differences(first, second) or differences(old, new, _same))[:3])


def _same(one: Any, other: Any) -> bool:
    """Return True if two values of a row are equal, numbers within the relative tolerance `SAME_SCORE`."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, int | float) and isinstance(other, int | float):
        return math.isclose(one, other, rel_tol=SAME_SCORE, abs_tol=1e-12)
    return bool(one == other)


def _link(path: Path, target: Path) -> None:
    """Make a hard link to a recording at `target`; copy the file if links are not supported."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(path, target)
    except OSError:
        shutil.copyfile(path, target)
