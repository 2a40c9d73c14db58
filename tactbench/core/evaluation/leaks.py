"""Find leaks: test rows that are also among the training rows, and feature channels that are copies of the target."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset, Mask
from tactbench.core.evaluation.splits import Assignment
from tactbench.core.recording.health import MONOTONE, is_copy
from tactbench.core.spec.row import LEAKS

BLOCK = 16
"""Number of consecutive rows that must be equal for a leak; a recording with fewer rows is one block."""
CHANGES = 0.5
"""Smallest share of rows in a block that differ from the row before; sensors at rest repeat the same row."""
MOST_SHARED = 0.05
"""Largest share of a fold's test rows that may equal training rows; two presses on a noisy sensor share no row."""
AT_REST = 4
"""Largest number of distinct test rows that may equal training rows, as those of an untouched sensor do."""
ODD = np.uint64(0x9E3779B97F4A7C15)
"""Odd factor of hashes, 2^64 over the golden ratio (Knuth, The art of computer programming, volume 3, section 6.4)."""
_Hashes = npt.NDArray[np.uint64]


def copied_channels(data: Dataset) -> tuple[str, ...]:
    """Return a warning that names channels from which a regression's target, or its magnitude, is computed; else ()."""
    if data.classes:
        return ()
    X, y = (data.column(attrgetter(name), data.labelled) for name in ("X", "y"))
    recording = data.recording[data.labelled]
    parts = [*y.reshape(len(y), -1).T]
    parts += [abs(part) for part in parts if part.min() < 0 < part.max()]  # a square loses the sign
    channels = zip(data.features, X.T, strict=True)
    found = [name for name, column in channels if any(is_copy(column, part, recording) for part in parts)]
    return (f"{LEAKS}{', '.join(found)} is {MONOTONE.format('the target')}.",) if found else ()


def leak_stamps(data: Dataset, assignments: Sequence[Assignment]) -> tuple[str, ...]:
    """Return a warning if over 5 % of a fold's test rows are also in its training or validation set; else ()."""
    rows = [_mixed(table.X, table.force).sum(axis=1, dtype=np.uint64) for table in data.tables]
    worst, pair = 0.0, ("", "")
    for fold in assignments:
        known = [_blocks(hashes[mask])[0] for hashes, mask in zip(rows, data.parted(_learned(fold)), strict=True)]
        tested = [_blocks(hashes[mask]) for hashes, mask in zip(rows, data.parted(fold.test), strict=True)]
        ends = np.cumsum([len(blocks) for blocks, _, _ in tested])
        met = np.isin(np.concatenate([blocks for blocks, _, _ in tested]), np.concatenate(known))
        covered = [
            np.unique(starts[mine][:, None] + np.arange(length)).size
            for (_, starts, length), mine in zip(tested, np.split(met, ends[:-1]), strict=True)
        ]
        share = sum(covered) / max(int(fold.test.sum()), 1)
        if share > worst:
            test = int(np.argmax(covered))
            train = int(np.argmax([np.isin(tested[test][0], blocks).sum() for blocks in known]))
            worst, pair = share, (data.tables[test].meta.name, data.tables[train].meta.name)
    if worst <= MOST_SHARED:
        return _single_rows(data, assignments)
    return (
        f"{LEAKS}{worst:.0%} of the test rows of a fold are equal to training rows, in blocks of {BLOCK}; "
        f"{pair[0]!r} repeats {pair[1]!r}.",
    )


def _learned(fold: Assignment) -> Mask:
    """Return a mask of the training and validation rows of a fold."""
    return fold.train if fold.validation is None else fold.train | fold.validation


def _single_rows(data: Dataset, assignments: Sequence[Assignment]) -> tuple[str, ...]:
    """Return a warning if over 5 % of a fold's test rows equal training rows, for data without clock; else ()."""
    if not all(one.meta.clock == "none" or len(one.row) == 1 for one in data.tables):
        return ()
    mixed = data.column(lambda table: _mixed(table.X, table.force, *([] if data.classes else [table.y])))
    rows, *halves = (mixed[:, start::step].sum(axis=1, dtype=np.uint64) for start, step in ((0, 1), (0, 2), (1, 2)))

    def shared(fold: Assignment) -> float:
        """Return the share of a fold's distinct test rows that equal a training row; 0 for four or fewer."""
        met = np.isin(np.unique(rows[fold.test]), rows[_learned(fold)])
        return float(met.mean()) if met.sum() > AT_REST else 0.0

    worst = max(map(shared, assignments))
    distinct, *by_half = (len(np.unique(one)) for one in (rows, *halves))
    # Coarse readings agree by chance, and then far more often in half of the columns than in all.
    if worst <= MOST_SHARED or min(by_half) < (1 - MOST_SHARED) * distinct:
        return ()
    return (f"{LEAKS}{worst:.0%} of the test rows of a fold are equal to training rows.",)


def _mixed(*columns: npt.NDArray[Any] | None) -> _Hashes:
    """Return (n, columns) hashes of numbers; rows are equal if their hashes summed over columns are equal.

    The reference force is included, since a sensor without noise repeats its readings where the reference does not.
    """
    X = np.column_stack([one for one in columns if one is not None]).astype(np.float64)
    bits = np.ascontiguousarray(X + 0.0).view(np.uint64)  # adding 0 makes -0 and 0 one
    mixed = (bits ^ (bits >> np.uint64(32))) * _factors(X.shape[1])
    return np.asarray(mixed ^ (mixed >> np.uint64(29)))


def _blocks(rows: _Hashes) -> tuple[_Hashes, npt.NDArray[np.int64], int]:
    """Return a hash of each block of consecutive rows that changes enough, its first row, and the length of blocks."""
    length = min(BLOCK, len(rows))
    if length < 2:
        return np.zeros(0, np.uint64), np.zeros(0, np.int64), length
    windows = np.lib.stride_tricks.sliding_window_view(rows, length)
    changing = (np.diff(windows, axis=1) != 0).mean(axis=1) >= CHANGES
    starts = np.flatnonzero(changing)
    return (windows[starts] * _factors(length)).sum(axis=1, dtype=np.uint64), starts, length


def _factors(count: int) -> _Hashes:
    """Return `count` odd factors for hashes: the powers of :data:`ODD`, modulo 2^64."""
    return np.cumprod(np.full(count, ODD), dtype=np.uint64)
