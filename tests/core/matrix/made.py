"""Rows, answers and recordings for a result folder, without a run."""

import hashlib

import numpy as np

from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solve import opening
from tactbench.core.plugins.registry import load_registry
from tactbench.core.samples import Answers
from tests.core.evaluation.made import record as write

SECTIONS = {
    "configuration": {"seed": 1},
    "versions": {"numpy": "2.0"},
    "source": {"acme": "0" * 32},
    "data": {"s": "d"},
}


def key(name) -> str:
    return hashlib.sha256(str(name).encode()).hexdigest()[:32]


def answers(n: int, seed: int = 0) -> Answers:
    rng = np.random.default_rng(seed)
    return Answers(
        y_true=rng.normal(size=n), y_pred=rng.normal(size=n), recording=np.arange(n) % 3, row=np.arange(n),
        fold=np.zeros(n, dtype=np.int64), time_s=np.arange(n) * 0.01, force_n=np.full(n, np.nan),
    )  # fmt: skip


def row(cell: str, status: str = "done", score: float | None = 1.0, **more):
    """Return a row with every key of the format."""
    task = load_registry().tasks["force"].spec
    whole = opening(Cell("icub", "force", "twin", "karl2016", "roles", "mean", (), False, 1), task)
    score = score if status == "done" else None
    known = {"score": score, "ci_low": score, "ci_high": score, "n_recordings": 1, "n_sessions": 1, "n_test": 3}
    told = known if status == "done" else {"reason": "untested"}
    named = key(cell) if status == "done" else ""
    return {**whole, **told, "cell": cell, "status": status, "simulated": True, "key": named, "host": "h1", **more}


def kept(store, cell: str, *given, sections=SECTIONS, n=3, **more):
    """Keep a cell, finished unless another status is given; return its row as it is read."""
    made = row(cell, *given, **more)
    return store.keep(made, sections, {"test": answers(n)} if made["status"] == "done" else {})


def record(path, reading: float = 1.0, seconds: float = 0.5):
    """Write a small recording; how long it took is no part of its content."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return write(path, np.full((5, 3), reading), simulated=True, session="s", provenance={"sim_s": seconds})
