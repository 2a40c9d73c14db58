"""Linear models."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.estimators.nonlinear import Wrapped
from tactbench.plugin import FloatArray


def least_squares(*, kind: str, seed: int, threads: int) -> Any:
    """Return ordinary least squares with an intercept."""
    from sklearn.linear_model import LinearRegression

    return LinearRegression()


def lasso(*, kind: str, seed: int, threads: int, lambda_: float) -> Any:
    """Return the Lasso: ``1/(2n) |y - Xb|² + lambda |b|_1``, scikit-learn's objective with ``alpha = lambda``.

    Stops at a duality gap of 1e-5 of ``|y|²``, ten times finer than scikit-learn's default. Taxels that rise
    together are nearly collinear: descent then takes tens of thousands of sweeps, which cost milliseconds on the Gram
    matrix and a hundred times more on the rows themselves.
    """
    from sklearn.linear_model import Lasso

    return Lasso(alpha=lambda_, precompute=True, tol=1e-5, max_iter=100_000)


def ridge(*, kind: str, seed: int, threads: int, alpha: float) -> Any:
    """Return ridge regression, ``|y - Xb|² + alpha |b|²``."""
    from sklearn.linear_model import Ridge

    return Ridge(alpha=alpha)


def logistic(*, kind: str, seed: int, threads: int, C: float) -> Any:
    """Return multinomial logistic regression with an L2 penalty.

    Newton's method reaches the minimum. L-BFGS stops short of it at a place that depends on the last bit: on the iCub's
    twelve taxels processors then differ by 1e-4 in macro F1.
    """
    from sklearn.linear_model import LogisticRegression

    return LogisticRegression(C=C, solver="newton-cg", tol=1e-8, max_iter=2000)


class Discriminant(Wrapped):
    """Linear discriminant analysis without warnings where the means of all classes coincide.

    scikit-learn then divides zero by zero for the share of variance of each direction, which is not used here.
    """

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Discriminant:
        """Learn from X (n, p) and y (n,); raises ValueError if no feature separates the classes."""
        try:
            with np.errstate(invalid="ignore"):
                self.model.fit(X, y)
        except IndexError as error:  # scikit-learn looks for the first of no directions
            raise ValueError("no feature varies enough to tell the classes apart") from error
        return self


def discriminant(*, kind: str, seed: int, threads: int) -> Any:
    """Return linear discriminant analysis (Fisher 1936): Gaussian classes with one covariance, nothing to set."""
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

    return Discriminant(LinearDiscriminantAnalysis())
