"""Finished rows whose replicates are stated: what statistics look at."""

import numpy as np

from tactbench.core.evaluation.metrics import METRICS
from tests.core.leaderboard import rows


def row(cell, sums, *, metric="rmse", classes=0, names=None, strata=None, **more):
    """Return a finished row whose replicates have these sums, (replicates, m)."""
    sums = np.asarray(sums, dtype=np.float64)
    lines = sums.tolist()
    if classes:
        lines = [[int(v) for k in np.flatnonzero(line) for v in (k, line[k])] for line in sums]
    names = [f"s{place:02}" for place in range(len(sums))] if names is None else list(names)
    return rows.row(cell, **{
        "cell": cell, "score": float(METRICS[metric].score(sums.sum(axis=0), classes)), "metric": metric,
        "ci_low": None, "ci_high": None, "classes": list(range(classes)), "n_sessions": len(sums),
        "replicates": {"unit": "session", "names": names, "strata": strata, "sums": lines}, **more,
    })  # fmt: skip


def mae_row(cell, means, n=100, **more):
    """Return a row of mean absolute error: each replicate has `n` rows and one of these means."""
    means = np.asarray(means, dtype=np.float64)
    return row(cell, np.column_stack([means * n, np.full(len(means), n)]), metric="mae", **more)
