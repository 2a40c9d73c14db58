"""From recordings, a split and an estimator to folds of X and y: the same for whoever answers, times or draws them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.selection import Build, scales
from tactbench.core.evaluation.sets import constant_features, keep, part
from tactbench.core.evaluation.splits import Assignment, make_splits
from tactbench.core.evaluation.vectors import PerComponent
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.plugins.registry import load_object
from tactbench.core.samples import Fold
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.task import TaskSpec, VectorTarget


def assigned(task: TaskSpec, estimator: EstimatorDescriptor, data: Dataset, split: str, seed: int) -> list[Assignment]:
    """Return the folds of `split`: groups of a campaign of its own one by one, gaps as long as the longest window."""
    return make_splits(data, split, seed, gap=max(estimator.window_grid), one_by_one=split in task.campaigns)


def builder(
    estimator: EstimatorDescriptor, params: Mapping[str, Any], task: TaskSpec, seed: int, threads: int
) -> Build:
    """Return what makes a fresh estimator from parameters; its imports are done, and one has been made to see.

    Where the task asks for a vector, it is one estimator a component.

    Raises
    ------
    UsageError
        If the estimator cannot answer this kind of question, or a parameter is not one of its own.
    """
    if task.kind not in estimator.kinds:
        raise UsageError(
            f"The estimator {estimator.name!r} does {' and '.join(estimator.kinds)}; task {task.name!r} is "
            f"{task.kind}.",
            hint="See what others do with `tactbench list estimators`.",
        )
    for name in params:
        if name not in estimator.params:
            raise UnknownNameError(f"parameter of estimator {estimator.name!r}", name, estimator.params)
    make = load_object(estimator.where)  # imports happen here, before any clock is read

    def build(chosen: Mapping[str, Any]) -> Estimator:
        made: Estimator = make(kind=task.kind, seed=seed, threads=threads, **{**estimator.params, **params, **chosen})
        return made

    build({})
    if isinstance(task.target, VectorTarget):
        return lambda chosen: PerComponent(lambda: build(chosen))
    return build


def prepared(assignment: Assignment, data: Dataset, rules: ProtocolSpec, k: int, counts: Counter[str]) -> Fold:
    """Return X and y of one fold: kept, scaled and filtered over `k` + 1 samples as the protocol has it.

    `counts` is told what was left out, and which features never change.
    """
    train = keep(data, rules, assignment.train, "training", counts)
    test = keep(data, rules, assignment.test, "test", counts)
    for name in constant_features(train, data.features):
        counts[f"folds in which {name} never changes in training"] += 1
    scale_train, scale_test = scales(rules, train, test)
    validation = None
    if assignment.validation is not None:
        kept = keep(data, rules, assignment.validation, "validation", counts)
        validation = part(kept, scales(rules, train, kept)[1], k)
    return Fold(assignment.name, part(train, scale_train, k), part(test, scale_test, k), validation)
