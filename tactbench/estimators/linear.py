"""Linear regression and classification models (least squares, Lasso, ridge, logistic, discriminant analysis)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.estimators.nonlinear import Wrapped
from tactbench.plugin import FloatArray


def least_squares(*, kind: str, seed: int, threads: int) -> Any:
    """Return a regressor by ordinary least squares with an intercept."""
    from sklearn.linear_model import LinearRegression

    return LinearRegression()


def lasso(*, kind: str, seed: int, threads: int, lambda_: float) -> Any:
    """Return the Lasso: ``1/(2n) |y - Xb|² + lambda |b|_1``, scikit-learn's objective with ``alpha = lambda``.

    The fit stops at a duality gap of 1e-5 of ``|y|²``, ten times finer than scikit-learn's default. Taxels that rise
    together are nearly collinear: coordinate descent then takes tens of thousands of sweeps, which cost milliseconds
    with the Gram matrix and a hundred times more with the rows themselves.
    """
    from sklearn.linear_model import Lasso

    return Lasso(alpha=lambda_, precompute=True, tol=1e-5, max_iter=100_000)


def ridge(*, kind: str, seed: int, threads: int, alpha: float) -> Any:
    """Return a ridge regressor, which minimises ``|y - Xb|² + alpha |b|²``."""
    from sklearn.linear_model import Ridge

    return Ridge(alpha=alpha)


def logistic(*, kind: str, seed: int, threads: int, C: float) -> Any:
    """Return multinomial logistic regression with an L2 penalty.

    The solver is Newton's method, which reaches the minimum. L-BFGS stops before the minimum, at a point that depends
    on the last bit: with the iCub's twelve taxels, results of different processors differ by 1e-4 in macro F1.
    """
    from sklearn.linear_model import LogisticRegression

    return LogisticRegression(C=C, solver="newton-cg", tol=1e-8, max_iter=2000)


class Discriminant(Wrapped):
    """Linear discriminant analysis without warnings where the means of all classes coincide.

    In this case scikit-learn divides zero by zero for each direction's share of the variance, which is not used here.
    """

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Discriminant:
        """Fit the classes y (n,) to the features X (n, p); raises ValueError if no feature separates the classes."""
        try:
            with np.errstate(invalid="ignore"):
                self.model.fit(X, y)
        except IndexError as error:  # scikit-learn looks for the first of no directions
            raise ValueError("no feature varies enough to separate the classes") from error
        return self


def discriminant(*, kind: str, seed: int, threads: int) -> Any:
    """Return linear discriminant analysis (Fisher 1936): Gaussian classes with a common covariance, no parameters."""
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

    return Discriminant(LinearDiscriminantAnalysis())
