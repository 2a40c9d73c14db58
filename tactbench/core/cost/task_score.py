"""Scores one task on recordings that a simulated rig makes for it, to show how a simulation changes the score."""

from __future__ import annotations

import tempfile
from pathlib import Path

from tactbench.core.errors import UsageError
from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import Registry
from tactbench.core.progress import Progress
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.spec.scene import Simulation


def quick_estimator(registry: Registry, task: str) -> str:
    """Return the name of a linear estimator for `task` that searches no parameters, the task's own before others.

    Where there is none, the first of these estimators.

    Raises
    ------
    UsageError
        If no estimator for this kind of question is installed, trivial ones aside.
    """
    spec = registry.tasks[task].spec
    fitting = [registry.estimators[name] for name in spec.estimators]
    fitting += [one for one in registry.estimators if spec.kind in one.kinds and not one.baseline]
    if not fitting:
        raise UsageError(f"No estimator for task {task!r} is installed.", hint="See `tactbench list estimators`.")
    return next((one.name for one in fitting if one.linear and not one.grid), fitting[0].name)


def task_score(registry: Registry, rig: str, sensor: str, task: str, simulation: Simulation, progress: Progress) -> Row:
    """Record every scene of `task` by `simulation` in a temporary folder and return the row of a quick estimator."""
    estimator = quick_estimator(registry, task)
    choice = TaskChoice(name=task, estimators=(EstimatorChoice(name=estimator),))
    matrix = MatrixSpec(
        rig=rig, seed=1, repeats=1, sensors=(sensor,), tasks=(choice,), simulation=simulation, latency=False
    )
    with tempfile.TemporaryDirectory(prefix="tactbench-score-") as folder:
        outcome = run_matrix(matrix, Store(Path(folder)), progress=progress)
    return next(row for row in outcome.rows if row["estimator"] == estimator)
