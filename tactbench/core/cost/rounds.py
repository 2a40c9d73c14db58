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

from tactbench.core.cost.timed_estimators import TimedEstimator
from tactbench.core.evaluation.delay import single_row_latency_s, single_row_preparation_s
from tactbench.core.evaluation.fitting import answers, fit
from tactbench.core.matrix.progress import Progress
from tactbench.core.plugins.interfaces import Estimator

WARM_UP_ROWS = 300
"""Rows of the fit that nobody times: it imports what a library imports late, and starts its threads."""

BUDGET_S = 20.0
"""Of one fit, or of one answer to all test rows, unless a caller says otherwise."""
THREADS = 1
"""That BLAS, OpenMP and estimators may use."""
REPEATS, REPEATS_S = 10, 0.05
"""What takes milliseconds is done up to ten times a round, within 0.05 s, and its median counts: one interruption by
the machine would else be all that is measured."""


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
    answers: npt.NDArray[Any] | None = None
    """to the test rows, by the last fit"""
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
    timing.answers = answers(timing._model, one.X_test, one.name, one.n_classes, one.y_test.shape[1:])


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
