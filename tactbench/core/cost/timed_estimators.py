"""What is to be timed: an estimator, and the very arrays its cell was answered with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.cell import load_task
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.delay import features_s, stated_delay_ms
from tactbench.core.evaluation.fitting import builder, features_of, select
from tactbench.core.evaluation.metrics import Metric, metric_called
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.summaries import without_windows
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.task import TaskSpec


@dataclass(frozen=True)
class TimedEstimator:
    """An estimator with its parameters chosen, and the training and test rows of one fold."""

    name: str
    build: Callable[[], Estimator]
    """Returns a fresh estimator; its imports are done."""
    fold: str
    X_train: FloatArray
    y_train: npt.NDArray[Any]
    X_test: FloatArray
    y_test: npt.NDArray[Any]
    n_classes: int
    metric: Metric | None
    """None: the score is not of rows"""
    trained_on: tuple[RecordingMeta, ...]
    """The recordings that the training rows are from."""
    looks_at: str = "features"
    k: int = 0
    """Rows that the mean filter looks back."""
    tared: bool = False
    delay_parts_ms: Mapping[str, float] = field(default_factory=dict)
    """Parts of the answer delay that no machine decides; see `tactbench.core.evaluation.delay`."""
    remarks: tuple[str, ...] = ()
    """on these parts"""
    features_s: Callable[[Callable[[], float]], float] | None = None
    """Given a clock, the seconds that the features of a frame take; None: those of a row are made from readings"""


def timed_estimator(
    task: TaskSpec,
    descriptor: EstimatorDescriptor,
    params: Mapping[str, Any],
    protocol: str,
    split: str,
    data: Dataset,
    *,
    seed: int,
) -> TimedEstimator:
    """Prepare `descriptor` as a cell does, for the last fold: the one whose model a cell's times are taken from.

    Parameters
    ----------
    params
        Those other than the estimator's defaults; they are not searched. Others are chosen anew on the validation
        data, which is not timed here: the cell's row has it.
    split
        One of those that the recordings can serve, as the cell's row names it.
    """
    metric, frames = metric_called(task.metric), task.answer_per == "frame"
    loaded = load_task(task, data, protocol, split, estimator=descriptor, seed=seed)
    descriptor = without_windows(descriptor, task)
    made, rules, assignment = loaded.data, loaded.rules, loaded.assignments[-1]
    build = builder(descriptor, params, task, seed, 1)
    choice = select(descriptor, params, build, made, rules, assignment, metric, Counter())
    k = choice.k if choice else descriptor.window_grid[0]
    fold = prepared(assignment, made, rules, k, Counter())
    chosen = choice.params if choice else {}
    parts, remarks = stated_delay_ms(data, made, task, rules, descriptor, k)

    def of_a_frame_s(clock: Callable[[], float]) -> float:
        return features_s(data, task, rules, descriptor, fold.test.X, k, clock) or 0.0

    return TimedEstimator(
        name=descriptor.name,
        build=lambda: build(chosen),
        fold=assignment.name,
        X_train=features_of(fold.train, descriptor),
        y_train=fold.train.y,
        X_test=features_of(fold.test, descriptor),
        y_test=fold.test.y,
        n_classes=0 if task.kind == "events" else len(made.classes),
        metric=metric if task.kind != "events" else None,
        trained_on=tuple(made.metas[place] for place in np.unique(fold.train.recording)),
        looks_at=descriptor.looks_at,
        k=k,
        tared=rules.tare,
        delay_parts_ms=parts,
        remarks=remarks,
        features_s=of_a_frame_s if frames else None,
    )
