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
    """Return the name of an estimator for `task` that costs little: a linear one that searches no parameters.

    The task's own come first, then those installed, then the task's own whatever they are.

    Raises
    ------
    UsageError
        If nothing that is no trivial answer is installed for this kind of question.
    """
    spec = registry.tasks[task].spec
    fitting = [one for one in registry.estimators if spec.kind in one.kinds and not one.baseline]
    own = [registry.estimators[name] for name in spec.estimators]
    for one in (*own, *fitting):
        if one.linear and not one.grid:
            return one.name
    if not (own or fitting):
        raise UsageError(f"No estimator for task {task!r} is installed.", hint="See `tactbench list estimators`.")
    return (own or fitting)[0].name


def task_score(
    registry: Registry, rig: str, sensor: str, task: str, simulation: Simulation, *, estimator: str, progress: Progress
) -> Row:
    """Record every scene of `task` by `simulation` and return the row of its cell; no file is kept.

    Everything is made anew, in processes of its own: no table of an earlier call makes a later one quicker.

    Raises
    ------
    UsageError
        If a name is unknown or the estimator cannot answer the task.
    """
    choice = TaskChoice(name=task, estimators=(EstimatorChoice(name=estimator),))
    matrix = MatrixSpec(
        rig=rig, seed=1, repeats=1, sensors=(sensor,), tasks=(choice,), simulation=simulation, latency=False
    )
    with tempfile.TemporaryDirectory(prefix="tactbench-score-") as folder:
        outcome = run_matrix(matrix, Store(Path(folder)), progress=progress)
    return next(row for row in outcome.rows if row["estimator"] == estimator)
