"""Make, fit and apply estimators, and choose their hyper-parameters without the test data."""

from __future__ import annotations

import importlib
import itertools
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from inspect import signature
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, PluginContractError, TactbenchError, UnknownNameError, UsageError
from tactbench.core.evaluation.dataset import Dataset, at_rows
from tactbench.core.evaluation.folds import TaskData
from tactbench.core.evaluation.metrics import METRICS, Metric
from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.evaluation.sets import keep, part, scale_of, taken
from tactbench.core.evaluation.splits import Assignment, inner_splits
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.plugins.registry import load_object
from tactbench.core.samples import FloatArray, Part
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.row import lower_is_better
from tactbench.core.spec.task import TaskSpec, VectorTarget

Build = Callable[[Mapping[str, Any]], Estimator]
"""Function from parameters to a new, unfitted estimator."""


def builder(
    estimator: EstimatorDescriptor, params: Mapping[str, Any], task: TaskSpec, seed: int, threads: int
) -> Build:
    """Return a function that makes a new estimator from parameters; for a vector target, one for each component.

    The estimator's code is imported, and one estimator is made on trial. Raises UsageError if the estimator is not for
    this kind of task, or has no parameter of a given name.
    """
    if task.kind not in estimator.kinds:
        raise UsageError(
            f"The estimator {estimator.name!r} is for {' and '.join(estimator.kinds)}, but task {task.name!r} is of "
            f"kind {task.kind}.",
            hint="Choose another estimator; `tactbench list estimators` shows the kinds of tasks of each.",
        )
    for name in params:
        if name not in estimator.params:
            raise UnknownNameError(f"parameter of estimator {estimator.name!r}", name, estimator.params)
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


def answers_to(part: Part, model: Estimator, descriptor: EstimatorDescriptor, n_classes: int) -> npt.NDArray[Any]:
    """Return the predictions of `model` for the rows of a set, checked by :func:`answers`."""
    return answers(model, features_of(part, descriptor), descriptor.name, n_classes, part.y.shape[1:])


def voted(part: Part, predicted: npt.NDArray[Any], n_classes: int) -> tuple[Part, npt.NDArray[Any]]:
    """Return the last row of each recording, and one answer per recording, combined from the (n,) answers to its rows.

    The answer is the most frequent class (the first of equally frequent ones), or the mean if `n_classes` is 0. Rows
    must be in order of recording and time.
    """
    places, code, counts = np.unique(part.recording, return_inverse=True, return_counts=True)
    rows = taken(part, np.cumsum(counts) - 1)
    if not n_classes:
        return rows, np.bincount(code, weights=predicted) / counts
    votes = np.zeros((len(places), n_classes), dtype=np.int64)
    np.add.at(votes, (code, predicted), 1)
    return rows, votes.argmax(axis=1)


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


def select(
    descriptor: EstimatorDescriptor,
    given: Mapping[str, Any],
    build: Build,
    data: Dataset,
    protocol: ProtocolSpec,
    assignment: Assignment,
    metric: Metric,
    counts: Counter[str],
) -> Choice | None:
    """Choose the estimator's parameters and mean filter from its grid for one fold; None if there is nothing to choose.

    Parameters `given` by the user are not searched, and the test rows of `assignment` are not used. Fits with a
    warning are counted in `counts`.
    """
    grid = {name: values for name, values in descriptor.grid.items() if name not in given}
    if not grid and len(descriptor.window_grid) <= 1:
        return None
    gap = max(descriptor.window_grid)
    held_back = assignment.validation
    masks = inner_splits(data, assignment, gap) if held_back is None else [(assignment.train, held_back)]
    pairs = []
    for learn, held_out in masks:
        try:
            train, other = (
                keep(data, protocol, rows, what, Counter())
                for rows, what in ((learn, "training"), (held_out, "validation"))
            )
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
        for values in itertools.product(*grid.values()):
            params = {**given, **dict(zip(grid, values, strict=True))}
            truth, answered = [], []
            for learned, check in filtered:
                model = build(params)
                fit(model, features_of(learned, descriptor), learned.y, descriptor.name, counts)
                predicted = answers_to(check, model, descriptor, n_classes)
                checked, combined = voted(check, predicted, n_classes) if data.vote else (check, predicted)
                truth.append(checked.y)
                answered.append(combined)
            score = metric.of(np.concatenate(truth), np.concatenate(answered), n_classes)
            tried.append(Choice(params, k, score))
    best_of = min if lower_is_better(metric.name) else max
    return best_of(tried, key=lambda candidate: candidate.score)  # of equals the first
