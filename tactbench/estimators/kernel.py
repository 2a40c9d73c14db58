"""Support vector machines (Cortes and Vapnik 1995) with a Gaussian kernel, as libsvm finds them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.estimators.target import OfUnitSpread
from tactbench.plugin import Estimator, FloatArray


class EveryNth:
    """A learner taught every n-th row, n such that at most `rows` are left: its fit grows with the rows squared.

    Rows that follow each other in time are nearly copies, so that every n-th one leaves out less than a random draw.
    """

    def __init__(self, model: Any, rows: int) -> None:
        self.model = model
        self.rows = rows

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> EveryNth:
        """Learn y (n,) from X (n, p)."""
        step = -(-len(X) // self.rows)
        self.model.fit(X[::step], y[::step])
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n,) answers to X (n, p)."""
        return np.asarray(self.model.predict(X))


def support_vectors(*, kind: str, seed: int, threads: int, C: float, gamma: float | str, rows: int) -> Estimator:
    """Return a support vector machine: one against one for classes, a tube of 0.1 of y's deviation for numbers.

    ``gamma="scale"`` is one over (features times their variance): the width of the cloud itself.
    """
    from sklearn.svm import SVC, SVR

    model = SVC(C=C, gamma=gamma) if kind == "classification" else OfUnitSpread(SVR(C=C, gamma=gamma, epsilon=0.1))
    return EveryNth(model, rows)
