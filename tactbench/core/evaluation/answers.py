"""Fit a model to the training rows of each fold, and compute its answers to the fold's test rows.

Regression and classification score each row (or recording), tasks of events each event (:func:`answered_fold`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.evaluation.dataset import Dataset, at_rows
from tactbench.core.evaluation.delay import Clock
from tactbench.core.evaluation.event_answers import EventRules, Scored
from tactbench.core.evaluation.fitting import Build, Choice, answers_to, features_of, fit, select, voted
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.metrics import Metric
from tactbench.core.evaluation.sets import prepared
from tactbench.core.evaluation.splits import Assignment
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import Answers, Fold, Part
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.scene import Role


@dataclass(frozen=True)
class Configured:
    """An estimator: its descriptor, the function that makes it, and the parameters that the user has set."""

    descriptor: EstimatorDescriptor
    build: Build
    params: Mapping[str, Any] = field(default_factory=dict)
    """Parameters set by the user, which are not searched."""
    fit_params: Mapping[str, Callable[[Part], Any]] = field(default_factory=dict)
    """Further arguments of the estimator's ``fit``: by name, the function from a training set to the argument."""


@dataclass(frozen=True)
class FittedFold:
    """A model and the fold to whose training set it was fitted."""

    fold: Fold
    model: Estimator
    choice: Choice | None
    """Parameters chosen on validation data; None if there was nothing to choose."""
    k: int
    """Number of earlier rows that the mean filter includes beside the current one."""
    spent: Mapping[str, float]
    """Computing times [s] of search and fit, by their names in :class:`Cost`."""


@dataclass(frozen=True)
class AnsweredFold:
    """Answers of a model to the sets of one fold, the scores of these answers, and the computing times."""

    name: str
    choice: Choice | None
    score: float
    validation: float | None
    """Score on validation data; None without such data."""
    sizes: tuple[int, int]
    """Numbers of training rows and of test answers: rows, recordings, or events plus one for each test recording."""
    untrained: tuple[Any, ...]
    """Classes of test rows that no training row has."""
    spent: Mapping[str, float]
    """Computing times [s], and number of rows in the timed prediction, by their names in :class:`Cost`."""
    sets: Mapping[Role, Answers]
    detected: Sequence[Scored] = ()
    """Scored test recordings of an event detection task, each with the fold's threshold; else empty."""


def fitted_fold(
    estimator: Configured, data: TaskData, assignment: Assignment, metric: Metric, counts: Counter[str], clock: Clock
) -> FittedFold:
    """Choose parameters and mean filter on validation data, then fit the estimator to the training set of a fold."""
    descriptor, made = estimator.descriptor, data.data
    began = clock()
    choice = select(descriptor, estimator.params, estimator.build, made, data.rules, assignment, metric, counts)
    search_s = clock() - began
    k = choice.k if choice else descriptor.window_grid[0]
    fold = prepared(assignment, made, data.rules, k, counts)
    for what, part in (("training", fold.train), ("test", fold.test)):
        if len(part) == 0:
            raise DataError(f"The {what} set of fold {fold.name!r} has no labelled row.", hint="Choose another split.")
    values = np.unique(fold.train.y, axis=0)
    if len(values) < 2:
        only = made.classes[int(values[0])] if made.classes else values[0]
        raise DataError(
            f"All training labels of fold {fold.name!r} are {only}; two different labels are needed to fit a model.",
            hint="Choose another split, or check the label column with `tactbench inspect`.",
        )
    if made.vote:
        lost = np.setdiff1d(made.recording[assignment.test & made.labelled], fold.test.recording)
        if lost.size:
            raise DataError(
                f"The protocol drops all rows of recording {made.metas[lost[0]].name!r}: it would have no answer.",
                hint="Use protocol `deployable-untared`, or leave the recording out.",
            )
    X = features_of(fold.train, descriptor)
    more = {name: of(fold.train) for name, of in estimator.fit_params.items()}
    model = estimator.build(choice.params if choice else {})
    began = clock()
    fit(model, X, fold.train.y, descriptor.name, counts, **more)
    return FittedFold(fold, model, choice, k, {"search_s": search_s, "fit_s": clock() - began})


def answered_fold(
    fitted: FittedFold,
    data: TaskData,
    descriptor: EstimatorDescriptor,
    metric: Metric,
    rules: EventRules | None,
    number: int,
    clock: Clock,
) -> AnsweredFold:
    """Compute and score a model's answers to its fold; keep those to validation and training rows of a single fold."""
    fold, made = fitted.fold, data.data
    n_classes = 0 if rules else len(made.classes)
    began = clock()
    predicted = answers_to(fold.test, fitted.model, descriptor, n_classes)
    predict_s = clock() - began
    given: dict[Role, tuple[Part, npt.NDArray[Any]]] = {"test": (fold.test, predicted)}
    if fold.validation is not None and len(fold.validation):
        given["validation"] = fold.validation, answers_to(fold.validation, fitted.model, descriptor, n_classes)
    single = len(data.assignments) == 1
    if single and not made.classes:
        given["train"] = fold.train, answers_to(fold.train, fitted.model, descriptor, 0)
    detected: Sequence[Scored] = ()
    if rules is None:
        sets: dict[Role, Answers] = {role: _rows(*one, made, number) for role, one in given.items()}
    else:
        scored = {role: rules.scored(*one, made) for role, one in given.items()}
        curves = {role: rules.curve(several) for role, several in scored.items()}
        threshold = rules.choose(curves.get("validation"))
        detected = [replace(one, threshold=threshold) for one in scored["test"]]
        sets = {
            role: rules.items(several, curves[role], made, number)
            for role, several in scored.items()
            if role == "test" or single
        }
    scores = {role: metric.of(one.y_true, one.y_pred, len(made.classes)) for role, one in sets.items()}
    untrained = np.setdiff1d(fold.test.y, fold.train.y).tolist() if made.classes else []
    return AnsweredFold(
        name=fold.name,
        choice=fitted.choice,
        score=scores["test"],
        validation=fitted.choice.score if fitted.choice else scores.get("validation"),
        sizes=(len(fold.train), len(sets["test"])),
        untrained=tuple(made.classes[int(one)] for one in untrained),
        spent={**fitted.spent, "predict_s": predict_s, "batch_rows": len(fold.test)},
        sets=sets if single else {"test": sets["test"]},
        detected=detected,
    )


def _rows(part: Part, predicted: npt.NDArray[Any], made: Dataset, number: int) -> Answers:
    """Return the answers to rows, combined into one per recording where the task asks for that, and the force."""
    if made.vote:
        part, predicted = voted(part, predicted, len(made.classes))
    force = at_rows(made, made.column(lambda table: np.nan if table.force is None else table.force), part)
    fold = np.full(len(part), number, dtype=np.int64)
    return Answers(part.y, predicted, part.recording, part.row, fold, part.time_s, force)
