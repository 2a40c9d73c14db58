"""Samples of one clock on another: never invented, only looked up."""

from __future__ import annotations

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.samples import IntArray, StreamData


def require_forward(data: StreamData, recording: str) -> int:
    """Return how many times of a stream equal the one before.

    Raises
    ------
    DataError
        If time runs backwards in it, or stands still: nothing can be aligned, filtered or split in time then.
    """
    if data.t_ns is None or len(data.t_ns) < 2:
        return 0
    steps = np.diff(data.t_ns)
    backward = int((steps < 0).sum())
    if backward or not steps.any():
        what = f"runs backwards {backward} times" if backward else "stands still"
        raise DataError(
            f"In recording {recording!r}, the time of {data.spec.name} {what}.",
            hint="See where with `tactbench inspect`; sort the rows before they are imported, or record again.",
        )
    return int((steps == 0).sum())


def nearest_rows(features: StreamData, other: StreamData, recording: str) -> IntArray:
    """Return, for every row of `features`, the row of `other` that belongs to it.

    Parameters
    ----------
    features, other
        Streams of the recording named `recording`, (n, …) and (m, …).

    Returns
    -------
    IntArray
        (n,) indices; -1 where the nearest sample is further away than half a median step of the slower clock.

    Raises
    ------
    DataError
        If there is no clock to align by and the numbers of rows differ, or time does not run forward.
    """
    n, m = len(features.data), len(other.data)
    if features.t_ns is None or other.t_ns is None:
        if n != m:
            raise DataError(
                f"In recording {recording!r}, {features.spec.name} has {n} rows and {other.spec.name} {m}, and there "
                "is no clock to align them by.",
                hint="Give the mapping a time column, or tables of equal length.",
            )
        return np.arange(n, dtype=np.int64)
    if n == m and np.array_equal(features.t_ns, other.t_ns):
        return np.arange(n, dtype=np.int64)
    if m == 0:
        return np.full(n, -1, dtype=np.int64)
    require_forward(other, recording)
    times = other.t_ns
    after = np.clip(np.searchsorted(times, features.t_ns), 0, m - 1)
    before = np.maximum(after - 1, 0)
    earlier = np.abs(features.t_ns - times[before]) <= np.abs(times[after] - features.t_ns)
    nearest = np.where(earlier, before, after)
    steps = [float(np.median(np.diff(t))) for t in (features.t_ns, times) if len(t) > 1]
    reach = max(steps, default=0.0) / 2
    near = np.abs(times[nearest] - features.t_ns) <= reach
    return np.where(near, nearest, -1).astype(np.int64)
