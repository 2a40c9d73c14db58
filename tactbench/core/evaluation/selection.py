"""Choosing hyper-parameters on data that is neither trained on nor tested on."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.fitting import answers, fit
from tactbench.core.evaluation.metrics import Metric
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import FeatureScale, SetRows, keep, part
from tactbench.core.evaluation.splits import Assignment, inner_splits
from tactbench.core.evaluation.vote import voted
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray, Part
from tactbench.core.spec.rig import EstimatorDescriptor

Build = Callable[[Mapping[str, Any]], Estimator]
"""Parameters -> a fresh estimator."""


@dataclass(frozen=True)
class Candidate:
    """Parameters and window that were tried, and how well they did on the validation data."""

    params: dict[str, Any]
    k: int
    score: float


@dataclass(frozen=True)
class Choice(Candidate):
    """The candidate that was chosen, and those that it was compared with."""

    compared: tuple[Candidate, ...] = ()
    """all candidates in the order in which they were tried, the chosen one among them"""


def features_of(one: Part, descriptor: EstimatorDescriptor) -> FloatArray:
    """Return what the estimator may look at."""
    if descriptor.looks_at == "time":
        return one.row.astype(np.float64)[:, None]
    if descriptor.looks_at == "nothing":
        return np.zeros((len(one), 1))
    return one.X


def scales(protocol: ProtocolSpec, train: SetRows, other: SetRows) -> tuple[FeatureScale, FeatureScale]:
    """Return the scales of a training set and another, as the protocol has it."""
    first = FeatureScale.of(train.X)
    return first, FeatureScale.of(other.X) if protocol.scaled_by == "each set" else first


def select(
    descriptor: EstimatorDescriptor,
    given: Mapping[str, Any],
    build: Build,
    data: Dataset,
    protocol: ProtocolSpec,
    assignment: Assignment,
    metric: Metric,
    counts: Counter[str] | None = None,
) -> Choice | None:
    """Choose the estimator's grid parameters and window for one fold; None if there is nothing to choose.

    The test rows of `assignment` are never looked at.

    Parameters
    ----------
    given
        Parameters the user has fixed: they are not searched.
    counts
        Told which fits came with a warning.

    Raises
    ------
    DataError
        If there is no data to choose on.
    """
    grid = {name: values for name, values in descriptor.grid.items() if name not in given}
    if not grid and len(descriptor.window_grid) <= 1:
        return None
    pairs = _pairs(data, protocol, assignment, max(descriptor.window_grid))
    n_classes = len(data.classes)
    counted: Counter[str] = Counter() if counts is None else counts
    tried: list[Candidate] = []
    sign = 1.0 if metric.higher_is_better else -1.0
    for k in descriptor.window_grid:
        filtered = [(part(a, scale_a, k), part(b, scale_b, k)) for a, scale_a, b, scale_b in pairs]
        for values in itertools.product(*grid.values()):
            params = {**given, **dict(zip(grid, values, strict=True))}
            score = _score(descriptor, build, params, filtered, metric, n_classes, counted, vote=data.vote)
            tried.append(Candidate(params, k, score))
    best = max(tried, key=lambda candidate: sign * candidate.score)  # of equals the first
    return Choice(best.params, best.k, best.score, tuple(tried))


def _pairs(
    data: Dataset, protocol: ProtocolSpec, assignment: Assignment, gap: int
) -> list[tuple[SetRows, FeatureScale, SetRows, FeatureScale]]:
    if assignment.validation is not None:
        masks = [(assignment.train, assignment.validation)]
    else:
        masks = inner_splits(data, assignment, gap)
    pairs = []
    for learn, check in masks:
        ignored: Counter[str] = Counter()
        try:
            train = keep(data, protocol, learn, "training", ignored)
            other = keep(data, protocol, check, "validation", ignored)
        except DataError:
            continue  # one inner set without rows is no reason against the others
        scale_train, scale_other = scales(protocol, train, other)
        if train.labelled.any() and other.labelled.any():
            pairs.append((train, scale_train, other, scale_other))
    if not pairs:
        raise DataError(
            f"Fold {assignment.name!r} has too few labelled rows to choose hyper-parameters on: some to learn from and "
            f"some to check with are needed, {gap} rows apart where one recording must serve both.",
            hint="Fix the parameters in the matrix (estimators: [{params: …}]), or use longer recordings.",
        )
    return pairs


def _score(
    descriptor: EstimatorDescriptor,
    build: Build,
    params: Mapping[str, Any],
    pairs: Sequence[tuple[Part, Part]],
    metric: Metric,
    n_classes: int,
    counts: Counter[str],
    *,
    vote: bool,
) -> float:
    """Return the score over all validation rows, or recordings, together."""
    truth, given = [], []
    for train, check in pairs:
        model = build(params)
        fit(model, features_of(train, descriptor), train.y, descriptor.name, counts)
        predicted = answers(model, features_of(check, descriptor), descriptor.name, n_classes, check.y.shape[1:])
        checked, combined = voted(check, predicted, n_classes) if vote else (check, predicted)
        truth.append(checked.y)
        given.append(combined)
    return metric.of(np.concatenate(truth), np.concatenate(given), n_classes)
