"""The mean filter over samples t-k … t."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tactbench.core.samples import FloatArray, IntArray


def causal_mean(X: FloatArray, k: int, segment: npt.NDArray[np.integer]) -> FloatArray:
    """Return the mean of each row and the up to `k` rows before it in its segment.

    Parameters
    ----------
    X
        (n, features)
    k
        Rows looked back; 0 returns `X`. The first rows of a segment average what there is.
    segment
        (n,) non-decreasing numbers; a window never crosses from one to another.

    Notes
    -----
    By cumulative sums of the centred columns: without centring, an offset of 1e8 would leave 1e-8 of its own size as
    error in every difference of sums.
    """
    if k == 0 or len(X) == 0:
        return X
    centre = X.mean(axis=0)
    total = np.concatenate([np.zeros((1, X.shape[1])), np.cumsum(X - centre, axis=0)])
    here = np.arange(len(X))
    start = np.maximum(here - k, _first_of(segment))
    return np.asarray((total[here + 1] - total[start]) / (here + 1 - start)[:, None] + centre)


def _first_of(segment: npt.NDArray[np.integer]) -> IntArray:
    """Return, for every row, the first row of its segment."""
    begins = np.concatenate([[True], segment[1:] != segment[:-1]])
    places = np.flatnonzero(begins)
    return np.asarray(places[np.cumsum(begins) - 1], dtype=np.int64)
