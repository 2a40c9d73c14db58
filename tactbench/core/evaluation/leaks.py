"""Answers that a recording gives away: test rows among the training rows, and channels that are the target."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset, Table
from tactbench.core.evaluation.splits import Assignment
from tactbench.core.recording.health import is_copy

BLOCK = 16
"""Consecutive rows that must be equal; a recording of fewer rows counts as a whole."""
CHANGES = 0.5
"""Share of the rows of a block that must differ from the row before: sensors at rest repeat themselves."""
MOST_SHARED = 0.05
"""Share of the test rows of a fold that is put up with. Two presses on a sensor with noise share none."""
_Hashes = npt.NDArray[np.uint64]


def copied_channels(data: Dataset) -> tuple[str, ...]:
    """Return a stamp if a channel is the target of a regression but for scale and offset, else nothing."""
    if data.classes:
        return ()
    targets = np.concatenate([table.y[table.labelled] for table in data.tables])
    parts = targets.reshape(len(targets), -1).T
    found = []
    for place, name in enumerate(data.features):
        column = np.concatenate([table.X[table.labelled, place] for table in data.tables])
        found += [name] * any(is_copy(column, part) for part in parts)
    return (f"leaks: {', '.join(found)} is the target but for scale and offset.",) if found else ()


def leak_stamps(data: Dataset, assignments: Sequence[Assignment]) -> tuple[str, ...]:
    """Return a stamp if readings of a fold's test set stand in its training set too, else nothing."""
    rows = [_row_hashes(table) for table in data.tables]
    worst, pair = 0.0, ("", "")
    for fold in assignments:
        learned = fold.train
        if fold.validation is not None:
            learned = tuple(one | other for one, other in zip(fold.train, fold.validation, strict=True))
        known = [_blocks(hashes[mask])[0] for hashes, mask in zip(rows, learned, strict=True)]
        tested = [_blocks(hashes[mask]) for hashes, mask in zip(rows, fold.test, strict=True)]
        ends = np.cumsum([len(blocks) for blocks, _, _ in tested])
        met = np.isin(np.concatenate([blocks for blocks, _, _ in tested]), np.concatenate(known))
        covered = [
            np.unique(starts[mine][:, None] + np.arange(length)).size
            for (_, starts, length), mine in zip(tested, np.split(met, ends[:-1]), strict=True)
        ]
        share = sum(covered) / max(sum(int(mask.sum()) for mask in fold.test), 1)
        if share > worst:
            test = int(np.argmax(covered))
            train = int(np.argmax([np.isin(tested[test][0], blocks).sum() for blocks in known]))
            worst, pair = share, (data.tables[test].meta.name, data.tables[train].meta.name)
    if worst <= MOST_SHARED:
        return ()
    return (
        f"leaks: {worst:.0%} of the test rows of a fold are equal to training rows, in blocks of {BLOCK}; "
        f"{pair[0]!r} repeats {pair[1]!r}.",
    )


def _row_hashes(table: Table) -> _Hashes:
    """Return a number for each row of readings and force: equal rows have equal ones, others hardly ever.

    With the force, since a sensor without noise repeats itself where the reference does not.
    """
    X = table.X if table.force is None else np.column_stack([table.X, table.force])
    bits = np.ascontiguousarray(X + 0.0).view(np.uint64)  # adding 0 makes -0 and 0 one
    mixed = (bits ^ (bits >> np.uint64(32))) * _factors(X.shape[1])
    return np.asarray((mixed ^ (mixed >> np.uint64(29))).sum(axis=1, dtype=np.uint64))


def _blocks(rows: _Hashes) -> tuple[_Hashes, npt.NDArray[np.int64], int]:
    """Return a number for each block of consecutive rows that changes enough, the block's first row, and its length."""
    length = min(BLOCK, len(rows))
    if length < 2:
        return np.zeros(0, np.uint64), np.zeros(0, np.int64), length
    windows = np.lib.stride_tricks.sliding_window_view(rows, length)
    changing = (np.diff(windows, axis=1) != 0).sum(axis=1) >= CHANGES * (length - 1)
    starts = np.flatnonzero(changing)
    return (windows[starts] * _factors(length)).sum(axis=1, dtype=np.uint64), starts, length


def _factors(count: int) -> _Hashes:
    """Return `count` odd numbers, always the same."""
    return np.random.default_rng(16).integers(0, 2**63, count, dtype=np.uint64) * np.uint64(2) + np.uint64(1)
