"""Make estimators, choose their hyper-parameters without the test data, fit them to folds, and score their answers.

Regression and classification score each row (or recording), tasks of events each event (:func:`answered_fold`).
"""

from __future__ import annotations

import importlib
import itertools
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from inspect import signature
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, PluginContractError, TactbenchError, UsageError
from tactbench.core.evaluation.dataset import Dataset, at_rows
from tactbench.core.evaluation.delay import Clock
from tactbench.core.evaluation.event_answers import EventRules, Scored
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.metrics import METRICS, Metric
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import keep, part, prepared, scale_of
from tactbench.core.evaluation.splits import Assignment, inner_splits
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.plugins.registry import load_object
from tactbench.core.samples import Answers, FloatArray, Fold, Part
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.row import lower_is_better
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec, VectorTarget

Build = Callable[[Mapping[str, Any]], Estimator]
"""Function from parameters to a new, unfitted estimator."""


def builder(
    estimator: EstimatorDescriptor, params: Mapping[str, Any], task: TaskSpec, seed: int, threads: int
) -> Build:
    """Return a function that makes a new estimator from parameters; for a vector target, one for each component.

    The estimator's code is imported, and one estimator is made on trial. Raises UsageError if the estimator is not for
    this kind of task.
    """
    if task.kind not in estimator.kinds:
        raise UsageError(
            f"The estimator {estimator.name!r} is for {' and '.join(estimator.kinds)}, but task {task.name!r} is of "
            f"kind {task.kind}.",
            hint="Choose another estimator; `tactbench list estimators` shows the kinds of tasks of each.",
        )
    make = load_object(estimator.where)  # imports happen here, before any clock is read

    def build(chosen: Mapping[str, Any]) -> Estimator:
        made: Estimator = make(kind=task.kind, seed=seed, threads=threads, **{**estimator.params, **params, **chosen})
        return made

    build({})
    return one_model_a_component(task, build)


def one_model_a_component(task: TaskSpec, build: Build) -> Build:
    """Return `build`, or for a vector target a function that makes a :class:`PerComponent` of such estimators."""
    return (lambda chosen: PerComponent(lambda: build(chosen))) if isinstance(task.target, VectorTarget) else build


class PerComponent:
    """Estimator of a vector: one model for each component, each made by `build` and fitted separately."""

    def __init__(self, build: Callable[[], Estimator]) -> None:
        self._build = build
        self._models: list[Estimator] = []

    def fit(self, X: FloatArray, y: npt.NDArray[Any], **params: Any) -> PerComponent:
        """Fit one model for each column of y (n, components) to X (n, p) and that column."""
        self._models = [self._build() for _ in range(y.shape[1])]
        for model, column in zip(self._models, y.T, strict=True):
            model.fit(X, np.ascontiguousarray(column), **params)
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return the (n, components) predictions for X (n, p)."""
        return np.column_stack([model.predict(X) for model in self._models])


def fit(model: Estimator, X: FloatArray, y: npt.NDArray[Any], name: str, counts: Counter[str], **params: Any) -> None:
    """Fit `model` to X (n, p) and y (n,) or (n, components), with `params` as further arguments of ``fit``.

    Warnings, such as of a solver that did not converge, are counted in `counts` under the estimator's `name`. Raises
    DataError if ``fit`` fails on the data.
    """
    refused = (ValueError, ArithmeticError, *((TypeError,) if params else ()))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            model.fit(X, y, **params)
        except refused as error:
            if isinstance(error, TactbenchError):
                raise
            wide, more = " x ".join(map(str, X.shape[1:])), f", params {', '.join(params)}" if params else ""
            raise DataError(
                f"The estimator {name!r} could not be fitted to {len(X)} rows of {wide} features{more}: {error}",
                hint="Check its parameters, or use another estimator.",
            ) from error
    for kind in sorted({warning.category.__name__ for warning in caught}):
        counts[f"fits of {name} with a {kind}"] += 1


def routed(estimator: Estimator, data: TaskData, given: Mapping[str, Any]) -> dict[str, Callable[[Part], Any]]:
    """Return functions from a training set to further arguments of the estimator's ``fit``, by scikit-learn's names.

    These are the arguments `given` (a text under ``groups`` or ``STEP__groups`` names a label of the recordings), and
    ``groups`` if the estimator, or a step of it, searches by cross-validation or has such an argument of ``fit``.
    """

    def of(name: str, value: Any) -> Callable[[Part], Any]:
        if name.rpartition("__")[2] in ("groups", "sample_weight"):
            value = data.per_row(f"params[{name!r}]", value)
        if isinstance(value, str) or np.shape(value)[:1] != data.y.shape[:1]:
            return lambda _: value
        return partial(at_rows, data.data, data.spread(np.asarray(value)))

    if importlib.import_module("sklearn").get_config()["enable_metadata_routing"]:
        routing = importlib.import_module("sklearn.utils.metadata_routing").get_routing_for_object(estimator)
        takes = sorted(routing.consumes("fit", ["groups"]))
    else:
        steps = [("groups", estimator), *((f"{name}__groups", one) for name, one in getattr(estimator, "steps", ()))]
        search = importlib.import_module("sklearn.model_selection._search").BaseSearchCV
        takes = [
            name for name, one in steps
            if isinstance(one, search) or (hasattr(one, "fit") and "groups" in signature(one.fit).parameters)
        ]  # fmt: skip
    return {name: of(name, value) for name, value in {**dict.fromkeys(takes, data.groups), **given}.items()}


def answers(
    model: Estimator, X: FloatArray, name: str, n_classes: int, components: tuple[int, ...] = ()
) -> npt.NDArray[Any]:
    """Return the predictions of `model` for X (n, p): (n,) numbers, or class indices below a non-zero `n_classes`.

    For vectors of d components, with `components` (d,), the shape is (n, d). Other answers raise PluginContractError.
    """
    given = np.asarray(model.predict(X))
    wrong = ""
    if given.shape != (len(X), *components):
        wrong = f"shape {given.shape}"
    elif given.dtype.kind not in "biuf":
        wrong = f"values of type {given.dtype}"
    elif not np.isfinite(given).all():
        wrong = f"{np.count_nonzero(~np.isfinite(given))} values that are NaN or infinite"
    elif n_classes and not np.isin(given, np.arange(n_classes)).all():
        wrong = "numbers that are not class indices (is the estimator a regressor?)"
    if wrong:
        expected = f"class indices below {n_classes}" if n_classes else "finite numbers"
        raise PluginContractError(
            f"The estimator {name!r} answered {len(X)} rows with {wrong}.",
            hint=f"Its predict(X) must return {len(X)} {expected}, one for each row.",
        )
    return given.astype(np.int64 if n_classes else np.float64)


@dataclass(frozen=True)
class Choice:
    """Parameters and mean filter (over `k` + 1 rows) that were chosen, and their score on validation data."""

    params: dict[str, Any]
    k: int
    score: float


def features_of(one: Part, descriptor: EstimatorDescriptor) -> FloatArray:
    """Return the (n, p) features for the estimator: readings, or (n, 1) row indices or zeros for a baseline."""
    if descriptor.looks_at == "time":
        return one.row.astype(np.float64)[:, None]
    if descriptor.looks_at == "nothing":
        return np.zeros((len(one), 1))
    return one.X


@dataclass(frozen=True)
class Configured:
    """An estimator, with all that is needed to fit it to the folds of a cell and to score its answers."""

    descriptor: EstimatorDescriptor
    build: Build
    params: Mapping[str, Any]
    """Parameters set by the user, which are not searched."""
    fit_params: Mapping[str, Callable[[Part], Any]]
    """Functions that compute further arguments of the estimator's ``fit`` from a training set, by argument name."""
    metric: Metric
    events: EventRules | None
    """Rules for alarms in an event detection task; None for other tasks."""
    clock: Clock
    counts: Counter[str]
    """Running counts of rows left out and of fits with a warning."""

    def answers_to(self, part: Part, model: Estimator, n_classes: int) -> npt.NDArray[Any]:
        """Return the predictions of `model` for the rows of a set, checked by :func:`answers`."""
        return answers(model, features_of(part, self.descriptor), self.descriptor.name, n_classes, part.y.shape[1:])


def select(estimator: Configured, data: Dataset, protocol: ProtocolSpec, assignment: Assignment) -> Choice | None:
    """Choose the estimator's parameters and mean filter from its grid for one fold; None if there is nothing to choose.

    Parameters set by the user are not searched, and the test rows of `assignment` are not used.
    """
    descriptor, metric = estimator.descriptor, estimator.metric
    grid = {name: values for name, values in descriptor.grid.items() if name not in estimator.params}
    if not grid and len(descriptor.window_grid) <= 1:
        return None
    gap = max(descriptor.window_grid)
    held_back = assignment.validation
    masks = inner_splits(data, assignment, gap) if held_back is None else [(assignment.train, held_back)]
    pairs = []
    for learn, held_out in masks:
        try:
            train = keep(data, protocol, learn, "training", Counter())
            other = keep(data, protocol, held_out, "validation", Counter())
        except DataError:
            continue  # one inner set without rows is no reason against the others
        if train.labelled.any() and other.labelled.any():
            pairs.append([(rows, scale_of(protocol, train, rows)) for rows in (train, other)])
    if not pairs:
        raise DataError(
            f"Fold {assignment.name!r} has too few labelled rows to choose hyper-parameters: rows for fitting and for "
            f"validation are needed, {gap} rows apart if they are of the same recording.",
            hint="Fix the parameters in the matrix (estimators: [{params: …}]), or use longer recordings.",
        )
    n_classes = len(data.classes)
    if metric.kind == "events":
        metric = METRICS["macro_f1"]  # of frames
    tried: list[Choice] = []
    for k in descriptor.window_grid:
        filtered = [[part(rows, scale, k) for rows, scale in pair] for pair in pairs]
        truth = np.concatenate([check.y for _, check in filtered])
        for values in itertools.product(*grid.values()):
            params = {**estimator.params, **dict(zip(grid, values, strict=True))}
            answered = []
            for learned, check in filtered:
                model = estimator.build(params)
                fit(model, features_of(learned, descriptor), learned.y, descriptor.name, estimator.counts)
                answered.append(estimator.answers_to(check, model, n_classes))
            tried.append(Choice(params, k, metric.of(truth, np.concatenate(answered), n_classes)))
    best_of = min if lower_is_better(metric.name) else max
    return best_of(tried, key=lambda candidate: candidate.score)  # of equals the first


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


def fitted_fold(estimator: Configured, data: TaskData, assignment: Assignment) -> FittedFold:
    """Choose parameters and mean filter on validation data, then fit the estimator to the training set of a fold."""
    descriptor, made, clock = estimator.descriptor, data.data, estimator.clock
    began = clock()
    choice = select(estimator, made, data.rules, assignment)
    search_s = clock() - began
    k = choice.k if choice else descriptor.window_grid[0]
    fold = prepared(assignment, made, data.rules, k, estimator.counts)
    for what, rows in (("training", fold.train), ("test", fold.test)):
        if len(rows) == 0:
            raise DataError(f"The {what} set of fold {fold.name!r} has no labelled row.", hint="Choose another split.")
    values = np.unique(fold.train.y, axis=0)
    if len(values) < 2:
        only = made.classes[int(values[0])] if made.classes else values[0]
        raise DataError(
            f"All training labels of fold {fold.name!r} are {only}; two different labels are needed to fit a model.",
            hint="Choose another split, or check the label column with `tactbench inspect`.",
        )
    X = features_of(fold.train, descriptor)
    more = {name: of(fold.train) for name, of in estimator.fit_params.items()}
    model = estimator.build(choice.params if choice else {})
    began = clock()
    fit(model, X, fold.train.y, descriptor.name, estimator.counts, **more)
    return FittedFold(fold, model, choice, k, {"search_s": search_s, "fit_s": clock() - began})


def answered_fold(estimator: Configured, data: TaskData, fitted: FittedFold, number: int) -> AnsweredFold:
    """Compute and score a model's answers to its fold; answers to non-test rows are kept only for a single fold."""
    fold, made, rules = fitted.fold, data.data, estimator.events
    n_classes = 0 if rules else len(made.classes)
    single = len(data.assignments) == 1
    parts: dict[Role, Part | None] = {"test": fold.test, "validation": fold.validation}
    if single and not made.classes:
        parts["train"] = fold.train
    given: dict[Role, tuple[Part, npt.NDArray[Any]]] = {}
    spent_s = []
    for role, rows in parts.items():
        if rows is not None and len(rows):
            began = estimator.clock()
            given[role] = rows, estimator.answers_to(rows, fitted.model, n_classes)
            spent_s.append(estimator.clock() - began)
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
    scores = {role: estimator.metric.of(one.y_true, one.y_pred, len(made.classes)) for role, one in sets.items()}
    untrained = np.setdiff1d(fold.test.y, fold.train.y).tolist() if made.classes else []
    return AnsweredFold(
        name=fold.name,
        choice=fitted.choice,
        score=scores["test"],
        validation=fitted.choice.score if fitted.choice else scores.get("validation"),
        sizes=(len(fold.train), len(sets["test"])),
        untrained=tuple(made.classes[int(one)] for one in untrained),
        spent={**fitted.spent, "predict_s": spent_s[0], "batch_rows": len(fold.test)},
        sets=sets if single else {"test": sets["test"]},
        detected=detected,
    )


def _rows(part: Part, predicted: npt.NDArray[Any], made: Dataset, number: int) -> Answers:
    """Return the answers to the rows of a set, with the force at these rows."""
    force = at_rows(made, made.column(lambda table: np.nan if table.force is None else table.force), part)
    fold = np.full(len(part), number, dtype=np.int64)
    return Answers(part.y, predicted, part.recording, part.row, fold, part.time_s, force)
