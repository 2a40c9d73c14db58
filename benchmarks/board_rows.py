"""A large made-up matrix, for the benchmarks of tables and pages: rows as the store reads them.

What many cells share (plan of effects, assumptions, remarks, counts) is one object, as in a store's rows; what each
cell has of its own (scores, times, key) is drawn at random, digit by digit, which is the hardest to write small.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

Row = dict[str, Any]

PLAN = [
    {"effect": name, "included": number % 2 == 0,
     "reason": f"{name} {'is' if number % 2 == 0 else 'is not'} called for: estimated {number + 1} % of the range"}
    for number, name in enumerate(("contact", "fluid", "creep", "thermal", "drift", "friction", "vibration", "noise"))
]  # fmt: skip
TRACEBACK = """Traceback (most recent call last):
  File "tactbench/core/matrix/answer.py", line 41, in answer
    result = evaluate(task, registry.estimators[cell.estimator], dict(cell.params), cell.protocol)
  File "tactbench/core/evaluation/cell.py", line 98, in evaluate
    model.fit(X, y)
ValueError: Input X contains NaN.
"""
ENDS = ("failed", "crashed", "timeout", "out-of-memory", "skipped")
FOLDS = 5


def make_rows(sensors: int, estimators: int, tasks: int, seed: int = 0) -> list[Row]:
    """Return `sensors` x `estimators` x `tasks` rows, one in two hundred stopped, two trivial answers a sensor."""
    draw = np.random.default_rng(seed)
    rows: list[Row] = []
    counts = [{"training rows beyond the range": n, "test rows beyond the range": 2 * n} for n in range(40)]
    assumptions = {"placement": "0.5 mm", "drift": "0.1 %/min", "noise": "datasheet"}
    for sensor in range(sensors):
        for task in range(tasks):
            level = draw.uniform(0.2, 2.0)
            shared = {
                "baseline": float(level * 1.5), "n_recordings": 12, "n_sessions": 6, "n_train": 40_000,
                "n_test": int(draw.integers(5_000, 50_000)), "sim_s": float(draw.uniform(1, 60)),
                "counts": counts[int(draw.integers(len(counts)))],
            }  # fmt: skip
            for estimator in range(estimators):
                rows.append(_row(sensor, task, estimator, shared, level, assumptions, draw))
    return rows


def _row(
    sensor: int, task: int, estimator: int, shared: Row, level: float, assumptions: Row, draw: np.random.Generator
) -> Row:
    baseline = estimator < 2
    name = ("mean", "median")[estimator] if baseline else f"estimator-{estimator}"
    params = {"depth": estimator} if estimator % 3 == 2 else {}
    options = "".join(f",{key}={value}" for key, value in params.items())
    cell = f"sensor-{sensor:03d}/task-{task:02d}/twin/deployable:session/{name}{options}/1"
    low, score, high = np.sort(draw.normal(level * (1.5 if baseline else 1.0), 0.05 * level, 3))
    fit, wait = 10 ** draw.uniform(-3, 2), 10 ** draw.uniform(-2, 1)
    row: Row = {
        "cell": cell, "sensor": f"sensor-{sensor:03d}", "task": f"task-{task:02d}", "rig": "twin",
        "protocol": "deployable", "split": "session", "estimator": name, "params": params, "is_baseline": baseline,
        "repeat": 1, "repeats": 1, "seed": 1, "status": "done", "reason": "", "traceback": "", "signal": None,
        "log": "", "metric": "rmse", "unit": "N", "score": float(score), "ci_low": float(low), "ci_high": float(high),
        "ci_method": "bootstrap over sessions", "published": None, "published_reference": "", "published_remark": "",
        "search_s": 0.0, "fit_s": float(fit), "predict_s": float(wait * 1e-3), "batch_rows": 1000,
        "latency_ms_p50": float(wait), "latency_ms_p95": float(wait * draw.uniform(1.05, 2.0)), "latency_n": 200,
        "threads": 1, "peak_rss_mb": float(draw.uniform(100, 400)), "wall_s": float(fit * 1.1 + 0.5), "concurrency": 1,
        "host": "0123456789ab", "made_by": "fedcba987654", "simulated": True, "dagger": False, "stamps": [],
        "remarks": [], "assumptions": assumptions, "plan": PLAN, "chosen": {}, "search": [],
        "recordings": [f"sensor-{sensor:03d}/scene-{task:02d}.h5"],
        "scores": {f"fold {fold}": float(draw.normal(score, 0.02)) for fold in range(1, FOLDS + 1)},
        "confusion": None, "classes": [], "equivalence": 0.05,
        "fold_sizes": {f"fold {fold}": [32_000, 8_000] for fold in range(1, FOLDS + 1)},
        "replicates": {"unit": "session", "names": [f"s{n}" for n in range(6)], "strata": None,
                       "sums": draw.uniform(0, 10, (6, 2)).tolist()},
        "key": hashlib.sha256(cell.encode()).hexdigest(), **shared,
    }  # fmt: skip
    if draw.integers(200) == 0:
        ended = ENDS[int(draw.integers(len(ENDS)))]
        row |= {"status": ended, "reason": f"the cell ended as {ended}", "score": None, "ci_low": None, "ci_high": None,
                "fit_s": None, "predict_s": None, "batch_rows": None, "latency_ms_p50": None, "latency_ms_p95": None,
                "scores": {}, "replicates": {}, "traceback": TRACEBACK if ended == "failed" else ""}  # fmt: skip
    return row
