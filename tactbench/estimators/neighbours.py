"""The answers of the nearest training rows."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.plugin import Estimator, FloatArray


class Neighbours:
    """Nearest neighbours that take all rows where there are fewer than were asked for."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Neighbours:
        """Keep X (n, p) and y (n,)."""
        self.model.set_params(n_neighbors=min(self.model.n_neighbors, len(X))).fit(X, y)
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n,) answers to X (n, p)."""
        return np.asarray(self.model.predict(X))


def neighbours(*, kind: str, seed: int, threads: int, n_neighbors: int) -> Estimator:
    """Return the vote, or the mean, of the `n_neighbors` nearest rows; all count alike.

    Fifteen (assumed): neighbours in feature space are mostly samples that followed each other; at 100 Hz five of them
    are a twentieth of a second and carry one draw of the slow noise.
    """
    from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor

    make = KNeighborsClassifier if kind == "classification" else KNeighborsRegressor
    return Neighbours(make(n_neighbors=n_neighbors, n_jobs=threads))
