"""Rows made by hand, with every key of the format."""

from itertools import cycle

from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solve import opening
from tactbench.core.spec.row import STATUSES
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


HOSTILE = (
    "\x1b[31mred\x1b[0m", "a|b\\|c", "[link](x)", "<b>&lt;</b>", "=1+1", "**bold** _a_ `code` ~~x~~",
    "$x$ #1 %c ^2 & ~ {}", "line\nbreak\u2028", "\ud800", "é 中 😀", "# heading #", "1. one", "", '"a", b;c\td',
)  # fmt: skip


def hostile_rows():
    """Rows with names that formats must escape, of every status, metric, protocol, split and rig."""
    metrics = (("rmse", "N", -1e6), ("macro_f1", "1", 0.0), ("accuracy", "1", 1.0), ("r2", "1", 123.456))
    rows = []
    for place, (name, status, (metric, unit, score)) in enumerate(
        zip(HOSTILE, cycle(("done", *STATUSES)), cycle(metrics))
    ):
        done = status == "done"
        rows.append(row(
            name, HOSTILE[-place], score if done else None, cell=f"{place} {name}", task=metric, metric=metric,
            unit=unit, params={name: name} if place % 2 else {}, status=status, reason="" if done else name,
            split=None if place % 5 == 0 and not done else ("session", "roles")[place % 2],
            protocol=("deployable", "karl2016")[place % 3 == 0], rig=("twin", "arm")[place % 2], simulated=done,
            is_baseline=place % 4 == 3, dagger=place % 3 == 0, stamps=[name] * (place % 2), published=score,
            ci_low=score if done else None, ci_high=None if place % 2 else score, sim_s=1e5, latency_ms_p50=None,
        ))  # fmt: skip
    return rows
