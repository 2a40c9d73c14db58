"""Metrics as functions of sums over rows, so that the score of any part of the rows is computed from partial sums.

Each metric has one function from rows to summands, a few numbers per row, and one from their sums to a score.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.samples import FloatArray
from tactbench.core.spec.row import HIGH_ERROR, MEDIAN_ERROR, TRUE
from tactbench.core.spec.task import VECTOR_METRIC, VectorTarget

Rows = Callable[[npt.NDArray[Any], npt.NDArray[Any], int], FloatArray]
Score = Callable[[FloatArray, int], FloatArray]


@dataclass(frozen=True)
class Metric:
    """A metric: the summands of each row, and the score as a function of their sums."""

    name: str
    kind: str
    rows: Rows
    """Function from labels y, predictions and the number of classes to (n, m) summands"""
    score: Score
    """Function from (…, m) sums and the number of classes to (…,) scores"""
    vector: bool = False
    """True if labels and predictions are vectors, (n, components)"""
    function: Callable[[npt.NDArray[Any], npt.NDArray[Any]], Any] | None = None
    """Function from labels y and predictions to the score of a caller's own metric, without summands; else None"""

    def of(self, y: npt.NDArray[Any], predicted: npt.NDArray[Any], n_classes: int = 0) -> float:
        """Return the score of predictions against labels `y`; infinite if squares of the predictions overflow.

        A caller's own metric that raises ValueError or ArithmeticError gives NaN; other errors become UsageError.
        """
        if self.function is not None:
            try:
                with warnings.catch_warnings(action="ignore"):
                    return float(self.function(y, predicted))
            except (ValueError, ArithmeticError):
                return float("nan")
            except Exception as error:
                raise UsageError(
                    f"The metric {self.name} failed on {len(y)} rows with {type(error).__name__}: {error}.",
                    hint="`metric` must be a function of (y, prediction) that returns a number.",
                ) from error
        with np.errstate(over="ignore", invalid="ignore"):
            return float(self.score(self.rows(y, predicted, n_classes).sum(axis=0), n_classes))


def _mean_of(error: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> Rows:
    """Return the function to the summands of a mean over rows, of `error` applied to prediction minus label."""
    return lambda y, predicted, _: np.column_stack([error(predicted - y), np.ones(len(y))])


_squares = _mean_of(np.square)


def lengths(vectors: npt.NDArray[Any]) -> FloatArray:
    """Return the (n,) Euclidean lengths of (n, components) vectors."""
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _explained(y: npt.NDArray[Any], predicted: npt.NDArray[Any], _: int) -> FloatArray:
    centred = y - np.mean(y)  # sums of squares of large offsets would lose all digits
    return np.column_stack([(predicted - y) ** 2, centred, centred**2, np.ones(len(y))])


def _pairs(y: npt.NDArray[Any], predicted: npt.NDArray[Any], n_classes: int) -> FloatArray:
    table = np.zeros((len(y), n_classes * n_classes))
    table[np.arange(len(y)), y.astype(np.int64) * n_classes + predicted.astype(np.int64)] = 1.0
    return table


def ratio(sums: FloatArray, _: int = 0) -> FloatArray:
    """Return the (…,) quotients of the first and the second of (…, m) sums."""
    return np.asarray(sums[..., 0] / sums[..., 1])


def _rmse(sums: FloatArray, _: int) -> FloatArray:
    return np.asarray(np.sqrt(ratio(sums)))


def _r2(sums: FloatArray, _: int) -> FloatArray:
    spread = sums[..., 2] - sums[..., 1] ** 2 / sums[..., 3]
    return np.asarray(1.0 - sums[..., 0] / np.where(spread > 0, spread, np.nan))


def confusion(sums: FloatArray, n_classes: int) -> FloatArray:
    """Return the (…, true class, predicted class) confusion matrices from the sums of a classification metric."""
    return sums.reshape(*sums.shape[:-1], n_classes, n_classes)


def _accuracy(sums: FloatArray, n_classes: int) -> FloatArray:
    table = confusion(sums, n_classes)
    return np.asarray(np.trace(table, axis1=-2, axis2=-1) / table.sum(axis=(-2, -1)))


def class_f1(sums: FloatArray, n_classes: int) -> FloatArray:
    """Return the (…, classes) F1 scores; 0 for a class that neither occurs nor is predicted, as in scikit-learn."""
    table = confusion(sums, n_classes)
    hit = np.diagonal(table, axis1=-2, axis2=-1)
    return np.asarray(2 * hit / np.maximum(table.sum(axis=-1) + table.sum(axis=-2), 1))


def _macro_f1(sums: FloatArray, n_classes: int) -> FloatArray:
    return np.asarray(class_f1(sums, n_classes).mean(axis=-1))


def _balanced(sums: FloatArray, n_classes: int) -> FloatArray:
    """Return the mean recall over the classes that occur among the true labels."""
    table = confusion(sums, n_classes)
    there = table.sum(axis=-1)
    hit = np.diagonal(table, axis1=-2, axis2=-1)
    return np.asarray((hit / np.maximum(there, 1)).sum(axis=-1) / (there > 0).sum(axis=-1))


def _of_events(y: npt.NDArray[Any], predicted: npt.NDArray[Any], _: int) -> FloatArray:
    """Return the summands of a mean of predictions over events: the rows whose y is 1."""
    return np.column_stack([y * predicted, y])


METRICS = {
    metric.name: metric
    for metric in (
        Metric("rmse", "regression", _squares, _rmse),
        Metric("mae", "regression", _mean_of(np.abs), ratio),
        Metric(VECTOR_METRIC, "regression", _mean_of(lengths), ratio, vector=True),
        Metric("r2", "regression", _explained, _r2),
        Metric("accuracy", "classification", _pairs, _accuracy),
        Metric("balanced_accuracy", "classification", _pairs, _balanced),
        Metric("macro_f1", "classification", _pairs, _macro_f1),
        Metric("recall_area", "events", _of_events, ratio),
    )
}


def _excess(sums: FloatArray, _: int) -> FloatArray:
    return ratio(sums) - ratio(sums[..., 2:])


EXCESS = Metric("excess_square", "regression", _squares, _excess)
"""Mean squared error minus the variance of the reference's noise, by which errors of force are ranked; may be negative.
Its sums are those of a RMSE, then squares and degrees of freedom of the unloaded holds; not a metric for tasks.
"""
SUMMED = {
    **METRICS,
    EXCESS.name: EXCESS,
    **{TRUE + one.name: one for one in METRICS.values() if one.kind == "regression" and not one.vector},
}
"""Metrics by name whose sums are stored for each replicate."""


def metric_called(name: str) -> Metric:
    """Return the metric of this name; raise UnknownNameError if there is none."""
    if name not in METRICS:
        raise UnknownNameError("metric", name, METRICS)
    return METRICS[name]


def vector_details(target: VectorTarget, y: npt.NDArray[Any], predicted: npt.NDArray[Any]) -> dict[str, float]:
    """Return the median and 95th percentile of the error's length over all rows, and the RMSE of each component."""
    error = lengths(predicted - y)
    squares = np.mean((predicted - y) ** 2, axis=0)
    return {
        MEDIAN_ERROR: float(np.median(error)),
        HIGH_ERROR: float(np.percentile(error, 95)),
        **{f"RMSE of {name}": float(np.sqrt(one)) for name, one in zip(target.names, squares, strict=True)},
    }
