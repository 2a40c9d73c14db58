"""Random forests (Breiman 2001), as scikit-learn builds them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.plugin import Estimator, FloatArray


class Forest:
    """A forest whose answers do not depend on which thread was faster.

    scikit-learn adds up the trees in the order in which its threads finish them, so that the last bits of a mean change
    from run to run. Here each thread answers rows of its own and adds the trees in order; a single row is answered
    without any thread.
    """

    def __init__(self, model: Any, threads: int) -> None:
        self.model = model
        self.threads = threads

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Forest:
        """Grow the trees on X (n, p) and y (n,)."""
        self.model.set_params(n_jobs=self.threads).fit(X, y)
        self.model.set_params(n_jobs=1)
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n,) answers to X (n, p)."""
        if self.threads == 1 or len(X) < 100 * self.threads:
            return np.asarray(self.model.predict(X))
        with ThreadPoolExecutor(self.threads) as pool:
            return np.concatenate(list(pool.map(self.model.predict, np.array_split(X, self.threads))))


def forest(
    *, kind: str, seed: int, threads: int, n_estimators: int, max_depth: int | None, min_samples_leaf: int
) -> Estimator:
    """Return a forest of `n_estimators` trees; the paper's curvature forest has 500."""
    from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor

    make = RandomForestClassifier if kind == "classification" else RandomForestRegressor
    model = make(
        n_estimators=n_estimators, max_depth=max_depth, min_samples_leaf=min_samples_leaf, random_state=seed
    )  # fmt: skip
    return Forest(model, threads)
