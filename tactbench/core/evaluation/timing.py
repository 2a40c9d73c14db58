"""What one answer costs: making its features ready, and predicting."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from tactbench.core.evaluation.sets import FeatureScale
from tactbench.core.evaluation.windows import causal_mean
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray

T = TypeVar("T")

WARM_UP = 1
AT_LEAST, AT_MOST = 20, 200
BUDGET_S = 0.3
CALLS_OF_P95 = 200
"""Fewer calls have too few beyond their 95th percentile (ten of 200) to state it; the largest is stated instead."""


def single_row_latency_s(model: Estimator, X: FloatArray, clock: Callable[[], float]) -> FloatArray:
    """Return (calls,) seconds of ``predict`` on one row whose features are ready.

    At least 20 calls and at most 200, within 0.3 s where 20 take less; the first is not counted. Rows are spread
    over `X`, so that a model that answers some rows faster is not flattered.
    """
    return calls_s(len(X), lambda place: X[place : place + 1], model.predict, clock)


def single_row_preparation_s(
    X: FloatArray, k: int, clock: Callable[[], float], *, tared: bool = False, at_most: int = AT_MOST
) -> FloatArray:
    """Return (calls,) seconds of making one row of features ready from the `k` + 1 readings that it is made of.

    At most `at_most` calls, else as :func:`single_row_latency_s`, with the code that prepares whole
    sets: taring if `tared`, scaling, the mean over the window. Rows of `X` stand for raw readings:
    values change no time.
    """
    rest, scale = np.zeros(X.shape[1]), FeatureScale(np.zeros(X.shape[1]), np.ones(X.shape[1]))
    segment = np.zeros(k + 1, dtype=np.int64)

    def ready(readings: FloatArray) -> FloatArray:
        return causal_mean(scale(readings - rest if tared else readings), k, segment[: len(readings)])[-1:]

    return calls_s(len(X), lambda place: X[max(0, place - k) : place + 1], ready, clock, at_most)


def tail_ms(spent_s: FloatArray) -> tuple[float | None, float]:
    """Return the 95th percentile in ms, None for fewer than 200 calls, and the largest."""
    enough = len(spent_s) >= CALLS_OF_P95
    return float(1e3 * np.quantile(spent_s, 0.95)) if enough else None, float(1e3 * spent_s.max())


def calls_s(
    rows: int,
    given: Callable[[int], T],
    work: Callable[[T], object],
    clock: Callable[[], float],
    at_most: int = AT_MOST,
) -> FloatArray:
    """Return (calls,) seconds of `work` on what is `given` for places spread over `rows`."""
    places = np.linspace(0, rows - 1, at_most).astype(int)
    for place in places[:WARM_UP]:
        work(given(place))
    spent: list[float] = []
    for place in np.random.default_rng(0).permutation(places):
        row = given(place)
        began = clock()
        work(row)
        spent.append(clock() - began)
        if len(spent) >= AT_LEAST and sum(spent) > BUDGET_S:
            break
    return np.array(spent)


def peak_rss_mb() -> float | None:
    """Return the largest resident memory of this process so far, MB; None where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak) / (2**20 if sys.platform == "darwin" else 2**10)
