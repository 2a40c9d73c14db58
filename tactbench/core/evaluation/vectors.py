"""Answers that are vectors: one model per component, and what is told of their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.metrics import distances
from tactbench.core.plugins.interfaces import Estimator
from tactbench.core.samples import FloatArray
from tactbench.core.spec.row import HIGH_ERROR, MEDIAN_ERROR
from tactbench.core.spec.task import VectorTarget


class PerComponent:
    """A model for each component of a vector, each taught as if it were asked for alone.

    Parameters
    ----------
    build
        Returns a fresh estimator of one number.
    """

    def __init__(self, build: Callable[[], Estimator]) -> None:
        self._build = build
        self._models: list[Estimator] = []

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> PerComponent:
        """Fit a model to X (n, p) and each column of y (n, components)."""
        self._models = [self._build() for _ in range(y.shape[1])]
        for model, column in zip(self._models, y.T, strict=True):
            model.fit(X, np.ascontiguousarray(column))
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n, components) answers to X (n, p)."""
        return np.column_stack([model.predict(X) for model in self._models])


def vector_details(target: VectorTarget, y: npt.NDArray[Any], predicted: npt.NDArray[Any]) -> dict[str, float]:
    """Return what stands beside the mean error: percentiles over all rows, and each component's own RMSE."""
    error = distances(y, predicted)
    squares = np.mean((predicted - y) ** 2, axis=0)
    return {
        MEDIAN_ERROR: float(np.median(error)),
        HIGH_ERROR: float(np.percentile(error, 95)),
        **{f"RMSE of {name}": float(np.sqrt(one)) for name, one in zip(target.names, squares, strict=True)},
    }
