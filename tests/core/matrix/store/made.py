"""Rows and answers for a result folder, without a run."""

import hashlib

import numpy as np

from tactbench.core.samples import Answers


def key(name) -> str:
    return hashlib.sha256(str(name).encode()).hexdigest()[:32]


def answers(n: int, seed: int = 0) -> Answers:
    rng = np.random.default_rng(seed)
    return Answers(
        y_true=rng.normal(size=n), y_pred=rng.normal(size=n), recording=np.arange(n) % 3, row=np.arange(n),
        fold=np.zeros(n, dtype=np.int64), time_s=np.arange(n) * 0.01, force_n=np.full(n, np.nan),
    )  # fmt: skip


def done(cell: str, score: float = 1.0, **more):
    return {"cell": cell, "status": "done", "metric": "mae", "score": score, "host": "h1", **more}


def ended(cell: str, status: str = "failed", **more):
    return {"cell": cell, "status": status, "reason": "a test says so", **more}


def kept(store, cell: str, score: float = 1.0, **more):
    store.keep(more.pop("key", key(cell)), done(cell, score, **more), {"test": answers(3)})


PLAN = [{"effect": f"effect {number}", "reason": "called for by a test, at length"} for number in range(6)]
"""Big enough to be shared."""


def whole(cell: str, score: float = 1.0, **more):
    """Return a finished row with every key of the format."""
    from tactbench.core.matrix.evaluate_cell import opening
    from tactbench.core.matrix.plan import Cell
    from tactbench.core.plugins.registry import load_registry

    task = load_registry().tasks["force"].spec
    row = opening(Cell("icub", "force", "twin", "karl2016", "roles", "mean", (), False, 1, 1, 1), task)
    scored = {"score": score, "ci_low": score, "ci_high": score, "n_recordings": 1, "n_sessions": 1, "n_test": 3}
    return {**row, **scored, "cell": cell, "status": "done", "simulated": True, "key": key(cell), **more}
