"""Rows made by hand, with every key of the format."""

from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solve import opening
from tactbench.core.spec.task import LabelTarget, TaskSpec

TASK = TaskSpec(
    name="question", title="t", question="?", kind="regression", target=LabelTarget(name="y"), metric="rmse",
    unit="N", protocols=("deployable",), estimators=("lasso",), baselines=("mean",),
)  # fmt: skip


def row(sensor="a", estimator="lasso", score=0.5, **more):
    cell = Cell(sensor, "question", "twin", "deployable", "session", estimator, (), estimator == "mean", 1)
    filled = opening(cell, TASK) | {
        "status": "done", "score": score, "ci_low": (score or 0) - 0.1, "ci_high": (score or 0) + 0.1, "n_test": 4400,
        "n_sessions": 1, "fit_s": 0.5, "predict_s": 1.0, "batch_rows": 1000, "latency_ms_p50": 0.02,
        "latency_ms_p95": 0.03, "simulated": True, "ci_method": "block bootstrap", "made_by": "0",
    }  # fmt: skip
    return filled | more
