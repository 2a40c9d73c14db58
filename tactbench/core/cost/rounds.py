"""Timing several estimators turn and turn about, so that a slow minute of the machine hits all of them alike."""

from __future__ import annotations

import gc
import importlib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.delay import features_s, single_row_latency_s, single_row_preparation_s, stated_delay_ms
from tactbench.core.evaluation.fitting import answers, builder, features_of, fit, select
from tactbench.core.evaluation.folds import load_task
from tactbench.core.evaluation.metrics import Metric, metric_called
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.summaries import without_windows
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.progress import Progress
from tactbench.core.samples import FloatArray
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.task import TaskSpec

WARM_UP_ROWS = 300
"""Rows of the fit that nobody times: it imports what a library imports late, and starts its threads."""

BUDGET_S = 20.0
"""Of one fit, or of one answer to all test rows, unless a caller says otherwise."""
THREADS = 1
"""That BLAS, OpenMP and estimators may use."""
REPEATS, REPEATS_S = 10, 0.05
"""What takes milliseconds is done up to ten times a round, within 0.05 s, and its median counts: one interruption by
the machine would else be all that is measured."""


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
        looks_at=descriptor.looks_at,
        k=k,
        tared=rules.tare,
        delay_parts_ms=parts,
        remarks=remarks,
        features_s=of_a_frame_s if frames else None,
    )


@dataclass
class Timing:
    """What one estimator took, seconds; one entry a round unless the budget cut it short."""

    fit_s: list[float] = field(default_factory=list)
    """of one fit on all training rows"""
    batch_s: list[float] = field(default_factory=list)
    """of one ``predict`` over all test rows"""
    latency_s: list[float] = field(default_factory=list)
    """of ``predict`` on one row, all calls of all rounds"""
    features_s: list[float] = field(default_factory=list)
    """of making one row of features ready, all calls of all rounds; none for answers that look at no reading"""
    trouble: Exception | None = None
    """what ended it"""
    _model: Estimator | None = field(default=None, repr=False)


def measure(
    timed_estimators: Mapping[str, TimedEstimator],
    *,
    rounds: int,
    budget_s: float = BUDGET_S,
    seed: int,
    clock: Callable[[], float],
    progress: Progress,
) -> Mapping[str, Timing]:
    """Time every estimator in every round, in an order drawn anew each round.

    Parameters
    ----------
    rounds
        How often; each round fits anew, answers all test rows, and single ones.
    budget_s
        A fit, or an answer to all test rows, that took longer once is not repeated.
    clock
        Seconds, monotonic.

    Returns
    -------
    mapping
        Under the keys of `timed_estimators`. What an estimator raises ends its own timing only.
    """
    found = {key: Timing() for key in timed_estimators}
    rng = np.random.default_rng(seed)
    for one in timed_estimators.values():
        progress.working(f"warm-up of {one.name}")
        _warm_up(one)
    progress.begin("timing", rounds * len(timed_estimators))
    with importlib.import_module("threadpoolctl").threadpool_limits(limits=THREADS):
        for number in range(rounds):
            for key in rng.permutation(sorted(timed_estimators)).tolist():
                one, timing = timed_estimators[key], found[key]
                progress.working(f"{one.name}, round {number + 1}")
                if timing.trouble is None:
                    try:
                        _turn(one, timing, budget_s, clock)
                    except Exception as error:
                        timing.trouble = error
                progress.advance(f"{one.name}, round {number + 1}")
    return found


def _turn(one: TimedEstimator, timing: Timing, budget_s: float, clock: Callable[[], float]) -> None:
    with _no_garbage_collection():
        if timing._model is None or max(timing.fit_s) <= budget_s:
            timing._model = None  # two forests at once would be one too many for some machines
            timing.fit_s.append(_median_s(lambda: _fit(one, timing), clock))
        if not timing.batch_s or max(timing.batch_s) <= budget_s:
            timing.batch_s.append(_median_s(lambda: _answer(one, timing), clock))
        assert timing._model is not None
        timing.latency_s.extend(single_row_latency_s(timing._model, one.X_test, clock))
        if one.features_s is not None:
            if one.looks_at in ("features", "reference"):
                timing.features_s.append(one.features_s(clock))
        elif one.looks_at == "features":
            timing.features_s.extend(single_row_preparation_s(one.X_test, one.k, clock, tared=one.tared))


def _fit(one: TimedEstimator, timing: Timing) -> None:
    model = one.build()
    fit(model, one.X_train, one.y_train, one.name, Counter())
    timing._model = model


def _answer(one: TimedEstimator, timing: Timing) -> None:
    assert timing._model is not None
    answers(timing._model, one.X_test, one.name, one.n_classes, one.y_test.shape[1:])


def _median_s(work: Callable[[], None], clock: Callable[[], float]) -> float:
    spent: list[float] = []
    while not spent or (len(spent) < REPEATS and sum(spent) < REPEATS_S):
        began = clock()
        work()
        spent.append(clock() - began)
    return float(np.median(spent))


def _warm_up(one: TimedEstimator) -> None:
    places = np.linspace(0, len(one.X_train) - 1, min(WARM_UP_ROWS, len(one.X_train))).astype(int)
    with warnings.catch_warnings(), suppress(Exception):  # what is wrong with it shows when it is timed
        warnings.simplefilter("ignore")
        model = one.build()
        model.fit(one.X_train[places], one.y_train[places])
        model.predict(one.X_test[:1])


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Collect now, and not while a clock runs: what others left behind is not this estimator's cost."""
    gc.collect()
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
