"""What the extra [fast] brings: forests of oneDAL against those of scikit-learn, and what tactbench's own layer costs.

Three forests of the paper's 500 trees on the very arrays that a cell of the curvature task is answered with, turn and
turn about, one thread: `forest` as tactbench builds it, the same RandomForestClassifier without any of tactbench's
code around it, and `forest-fast`. Each round fits and asks single rows; the order changes from round to round. F1 is
measured once for each of several seeds of the forests. Needs the extra: pip install 'tactbench[fast]'.

Usage: python benchmarks/fast_forest.py [ROUNDS [SENSOR]]
"""

from __future__ import annotations

import dataclasses
import os
import random
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import f1_score
from threadpoolctl import threadpool_limits

from tactbench.core.evaluation.delay import calls_s
from tactbench.core.evaluation.folds import load_task
from tactbench.core.evaluation.sets import prepared
from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_object, load_registry
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice

TASK, PROTOCOL, TREES, SEEDS = "curvature", "karl2016", 500, (1, 2, 3, 4, 5)
GOAL_LATENCY, GOAL_F1 = 5.0, 0.01
"""Stated before measuring: at least so many times quicker for one row, and no further apart in macro F1."""


@dataclasses.dataclass
class Forest:
    """A forest, the arrays of its cell, and what it took in seconds."""

    build: Callable[[], Any]
    X_train: np.ndarray
    y_train: np.ndarray
    X_test: np.ndarray
    y_test: np.ndarray
    fit_s: list[float] = dataclasses.field(default_factory=list)
    batch_s: list[float] = dataclasses.field(default_factory=list)
    latency_s: list[float] = dataclasses.field(default_factory=list)

    def turn(self) -> None:
        """Fit once, answer all test rows at once, then single ones."""
        model, began = self.build(), time.perf_counter()
        model.fit(self.X_train, self.y_train)
        fitted = time.perf_counter()
        model.predict(self.X_test)
        self.fit_s.append(fitted - began)
        self.batch_s.append(time.perf_counter() - fitted)
        self.latency_s.extend(calls_s(self.X_test[:, None], model.predict, time.perf_counter))

    def f1(self) -> float:
        """Return the macro F1 on the test rows."""
        return f1_score(self.y_test, self.build().fit(self.X_train, self.y_train).predict(self.X_test), average="macro")


def arrays(sensor: str, folder: Path) -> Forest:
    """Return the arrays of a cell, and no forest yet."""
    registry = load_registry()
    choice = TaskChoice(name=TASK, protocol=PROTOCOL, estimators=(EstimatorChoice(name="majority"),))
    row = run_matrix(MatrixSpec(repeats=1, sensors=(sensor,), tasks=(choice,)), Store(folder)).rows[0]
    data = load_task(
        registry.tasks[TASK].spec, [folder / path for path in row["recordings"]], PROTOCOL, "roles", seed=1
    )
    fold = prepared(data.assignments[-1], data.data, data.rules, 0, Counter())
    return Forest(lambda: None, fold.train.X, fold.train.y, fold.test.X, fold.test.y)


def of_seed(one: Forest, name: str, seed: int) -> Forest:
    """Return a forest on the same arrays."""
    if name == "scikit-learn alone":
        build = lambda: RandomForestClassifier(TREES, random_state=seed, n_jobs=1)  # noqa: E731
    else:
        descriptor = load_registry().estimators[name]
        make = load_object(descriptor.where)
        build = lambda: make(kind="classification", seed=seed, threads=1, **descriptor.params)  # noqa: E731
    return Forest(build, one.X_train, one.y_train, one.X_test, one.y_test)


def main() -> None:
    """Measure, and print the table and whether the goals are met."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    sensor = sys.argv[2] if len(sys.argv) > 2 else "icub"
    names = ("forest", "scikit-learn alone", "forest-fast")
    with tempfile.TemporaryDirectory() as folder:
        plain = arrays(sensor, Path(folder))
    times = {name: of_seed(plain, name, 1) for name in names}
    order = random.Random(1)
    with threadpool_limits(1):
        for _ in range(rounds):
            for name in order.sample(names, len(names)):
                times[name].turn()
        scores = {name: [of_seed(plain, name, seed).f1() for seed in SEEDS] for name in names}
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{sensor}, {TASK}, {PROTOCOL}: {len(plain.X_train)} training rows of {plain.X_train.shape[1]} features, "
          f"{TREES} trees, one thread, {rounds} rounds, load {load:.1f} on {os.cpu_count()} cores")  # fmt: skip
    print(f"{'':<20}{'fit, s':>22}{'one row, ms: p50':>18}{'p95':>9}{'all rows, µs/row':>18}   macro F1 of seeds")
    for name in names:
        timing = times[name]
        latency = sorted(1e3 * value for value in timing.latency_s)
        batch = 1e6 * statistics.median(timing.batch_s) / len(plain.X_test)
        fit = f"{statistics.median(timing.fit_s):.2f} [{min(timing.fit_s):.2f}, {max(timing.fit_s):.2f}]"
        print(f"{name:<20}{fit:>22}{statistics.median(latency):>18.3f}{latency[int(0.95 * len(latency))]:>9.3f}"
              f"{batch:>18.1f}   {statistics.mean(scores[name]):.4f} "
              f"[{min(scores[name]):.4f}, {max(scores[name]):.4f}]")  # fmt: skip
    middle = {name: statistics.median(times[name].latency_s) for name in names}
    fits = {name: statistics.median(times[name].fit_s) for name in names}
    quicker = middle["forest"] / middle["forest-fast"]
    apart = max(abs(a - b) for a, b in zip(scores["forest"], scores["forest-fast"], strict=True))
    print(f"latency, forest / forest-fast: {quicker:.1f} (goal: at least {GOAL_LATENCY:g}: "
          f"{'met' if quicker >= GOAL_LATENCY else 'MISSED'})")  # fmt: skip
    print(f"fit, forest / forest-fast: {fits['forest'] / fits['forest-fast']:.2f}")
    print(f"latency, forest / scikit-learn alone: {middle['forest'] / middle['scikit-learn alone']:.3f}; "
          f"fit: {fits['forest'] / fits['scikit-learn alone']:.3f}")  # fmt: skip
    print(f"largest difference of F1, seed by seed: {apart:.4f} (goal: at most {GOAL_F1:g}: "
          f"{'met' if apart <= GOAL_F1 else 'MISSED'})")  # fmt: skip


if __name__ == "__main__":
    main()
