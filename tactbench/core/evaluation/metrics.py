"""Metrics as sums over rows, so that a bootstrap adds up blocks instead of computing anew.

Each metric turns rows into a few numbers that may be summed, and sums into a score.
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
    """One figure of merit."""

    name: str
    kind: str
    rows: Rows
    """(y, prediction, number of classes) -> (n, m) summands"""
    score: Score
    """(…, m) sums and the number of classes -> (…,) scores"""
    vector: bool = False
    """Truth and predictions are (n, components)."""
    function: Callable[[npt.NDArray[Any], npt.NDArray[Any]], Any] | None = None
    """(y, prediction) -> score, of a metric of the caller's own, which is no sum over rows"""

    def of(self, y: npt.NDArray[Any], predicted: npt.NDArray[Any], n_classes: int = 0) -> float:
        """Return the score of `predicted` against `y`; infinite where squares of the answers overflow.

        A caller's own metric is NaN where it raises ValueError; whatever else it raises becomes UsageError.
        """
        if self.function is not None:
            try:
                with warnings.catch_warnings(action="ignore"):
                    return float(self.function(y, predicted))
            except (ValueError, ArithmeticError):
                return float("nan")
            except Exception as error:
                raise UsageError(
                    f"The metric {self.name} cannot be computed of {len(y)} rows: {type(error).__name__}: {error}.",
                    hint="`metric` takes a function of (y, prediction) that returns a number.",
                ) from error
        with np.errstate(over="ignore", invalid="ignore"):
            return float(self.score(self.rows(y, predicted, n_classes).sum(axis=0), n_classes))


def _mean_of(error: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> Rows:
    """Return the summands of a mean over rows of `error` of their differences."""
    return lambda y, predicted, _: np.column_stack([error(predicted - y), np.ones(len(y))])


_squares = _mean_of(np.square)


def lengths(vectors: npt.NDArray[Any]) -> FloatArray:
    """Return the (n,) Euclidean lengths of (n, components)."""
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _explained(y: npt.NDArray[Any], predicted: npt.NDArray[Any], _: int) -> FloatArray:
    centred = y - np.mean(y)  # sums of squares of large offsets would lose all digits
    return np.column_stack([(predicted - y) ** 2, centred, centred**2, np.ones(len(y))])


def _pairs(y: npt.NDArray[Any], predicted: npt.NDArray[Any], n_classes: int) -> FloatArray:
    table = np.zeros((len(y), n_classes * n_classes))
    table[np.arange(len(y)), y.astype(np.int64) * n_classes + predicted.astype(np.int64)] = 1.0
    return table


def ratio(sums: FloatArray, _: int = 0) -> FloatArray:
    """Return (…,) the first of (…, m) sums over the second."""
    return np.asarray(sums[..., 0] / sums[..., 1])


def _rmse(sums: FloatArray, _: int) -> FloatArray:
    return np.asarray(np.sqrt(ratio(sums)))


def _r2(sums: FloatArray, _: int) -> FloatArray:
    spread = sums[..., 2] - sums[..., 1] ** 2 / sums[..., 3]
    return np.asarray(1.0 - sums[..., 0] / np.where(spread > 0, spread, np.nan))


def confusion(sums: FloatArray, n_classes: int) -> FloatArray:
    """Return (…, true class, predicted class) from sums of a classification metric."""
    return sums.reshape(*sums.shape[:-1], n_classes, n_classes)


def _accuracy(sums: FloatArray, n_classes: int) -> FloatArray:
    table = confusion(sums, n_classes)
    return np.asarray(np.trace(table, axis1=-2, axis2=-1) / table.sum(axis=(-2, -1)))


def class_f1(sums: FloatArray, n_classes: int) -> FloatArray:
    """Return (…, classes) F1 of each class; 0 for a class that is neither there nor predicted, as in scikit-learn."""
    table = confusion(sums, n_classes)
    hit = np.diagonal(table, axis1=-2, axis2=-1)
    return np.asarray(2 * hit / np.maximum(table.sum(axis=-1) + table.sum(axis=-2), 1))


def _macro_f1(sums: FloatArray, n_classes: int) -> FloatArray:
    return np.asarray(class_f1(sums, n_classes).mean(axis=-1))


def _balanced(sums: FloatArray, n_classes: int) -> FloatArray:
    """Return the mean recall over the classes that are there."""
    table = confusion(sums, n_classes)
    there = table.sum(axis=-1)
    hit = np.diagonal(table, axis1=-2, axis2=-1)
    return np.asarray((hit / np.maximum(there, 1)).sum(axis=-1) / (there > 0).sum(axis=-1))


def _of_events(y: npt.NDArray[Any], predicted: npt.NDArray[Any], _: int) -> FloatArray:
    """Return the summands of a mean over the rows that are events."""
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
"""Mean square beyond the floor of the reference, below zero where chance has it so: errors of force are ranked by it.
Its sums are a RMSE's, then squares and degrees of freedom of the unloaded holds; no task may ask for it.
"""
SUMMED = {
    **METRICS,
    EXCESS.name: EXCESS,
    **{TRUE + one.name: one for one in METRICS.values() if one.kind == "regression" and not one.vector},
}
"""Metrics whose sums replicates keep."""


def metric_called(name: str) -> Metric:
    """Return a metric by name; raises UnknownNameError."""
    if name not in METRICS:
        raise UnknownNameError("metric", name, METRICS)
    return METRICS[name]


def vector_details(target: VectorTarget, y: npt.NDArray[Any], predicted: npt.NDArray[Any]) -> dict[str, float]:
    """Return percentiles of the error over all rows, and each component's own RMSE."""
    error = lengths(predicted - y)
    squares = np.mean((predicted - y) ** 2, axis=0)
    return {
        MEDIAN_ERROR: float(np.median(error)),
        HIGH_ERROR: float(np.percentile(error, 95)),
        **{f"RMSE of {name}": float(np.sqrt(one)) for name, one in zip(target.names, squares, strict=True)},
    }
