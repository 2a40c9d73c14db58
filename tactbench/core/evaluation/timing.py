"""What an answer costs: latency of one row, and of many."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray

WARM_UP = 1
AT_LEAST, AT_MOST = 20, 200
BUDGET_S = 0.3


def single_row_latency_s(model: Estimator, X: FloatArray, clock: Callable[[], float]) -> FloatArray:
    """Return (calls,) seconds of ``predict`` on one row whose features are ready.

    At least 20 calls and at most 200, within 0.3 s where 20 take less; the first is not counted. Rows are spread
    over `X`, so that a model that answers some rows faster is not flattered.
    """
    wanted = np.linspace(0, len(X) - 1, AT_MOST).astype(int)
    for place in wanted[:WARM_UP]:
        model.predict(X[place : place + 1])
    spent: list[float] = []
    for place in np.random.default_rng(0).permutation(wanted):
        row = X[place : place + 1]
        began = clock()
        model.predict(row)
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
