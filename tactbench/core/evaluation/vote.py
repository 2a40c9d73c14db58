"""From the answers to single rows to one answer a recording."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.splits import Mask
from tactbench.core.samples import Part


def voted(part: Part, predicted: npt.NDArray[Any], n_classes: int) -> tuple[Part, npt.NDArray[Any]]:
    """Return the last row of each recording, and the answer to all of its rows.

    Parameters
    ----------
    part, predicted
        Rows in order of recording and time, and the (n,) answers to them.
    n_classes
        The answer is the commonest class, of equals the first; where 0, the mean.
    """
    places, code, counts = np.unique(part.recording, return_inverse=True, return_counts=True)
    last = np.cumsum(counts) - 1
    rows = Part(part.X[last], part.y[last], part.time_s[last], part.recording[last], part.row[last], part.cluster[last])
    if not n_classes:
        return rows, np.bincount(code, weights=predicted) / counts
    votes = np.zeros((len(places), n_classes), dtype=np.int64)
    np.add.at(votes, (code, predicted), 1)
    return rows, votes.argmax(axis=1)


def require_answers(data: Dataset, test: tuple[Mask, ...], tested: Part) -> None:
    """Refuse a test set of which a recording has no row left that could be answered; raises DataError."""
    answered = set(tested.recording.tolist())
    for place, (table, mask) in enumerate(zip(data.tables, test, strict=True)):
        if place not in answered and (mask & table.labelled).any():
            raise DataError(
                f"The protocol leaves no row of recording {table.meta.name!r}, which is to be answered as a whole.",
                hint="Use --protocol deployable-untared, or leave the recording out.",
            )
