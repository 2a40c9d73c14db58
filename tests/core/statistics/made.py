"""Rows made by hand: what statistics look at, and nothing else."""

import numpy as np

from tactbench.core.evaluation.metrics import METRICS


def row(cell, sums, *, metric="rmse", classes=0, names=None, unit="session", strata=None, **more):
    """Return a finished row whose replicates have these sums, (replicates, m)."""
    sums = np.asarray(sums, dtype=np.float64)
    score = float(METRICS[metric].score(sums.sum(axis=0), classes))
    lines = sums.tolist()
    if classes:
        lines = [[int(v) for k in np.flatnonzero(line) for v in (k, line[k])] for line in sums]
    names = [f"s{place:02}" for place in range(len(sums))] if names is None else list(names)
    return {
        "cell": cell, "sensor": cell, "task": "question", "rig": "twin", "protocol": "deployable", "split": "session",
        "estimator": "lasso", "params": {}, "repeat": 1, "repeats": 1, "status": "done", "is_baseline": False,
        "metric": metric, "unit": "N", "score": score, "ci_low": None, "ci_high": None, "equivalence": None,
        "baseline": None, "simulated": True, "dagger": False, "stamps": [], "scores": {},
        "classes": list(range(classes)), "n_sessions": len(sums), "n_test": int(sums[:, -1].sum()),
        "replicates": {"unit": unit, "names": names, "strata": strata, "sums": lines},
    } | more  # fmt: skip


def mae_row(cell, means, n=100, **more):
    """Return a row of mean absolute error: each replicate has `n` rows and one of these means."""
    means = np.asarray(means, dtype=np.float64)
    return row(cell, np.column_stack([means * n, np.full(len(means), n)]), metric="mae", **more)
