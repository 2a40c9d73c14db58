"""Linear regression and classification models (least squares, Lasso, ridge, logistic)."""

from __future__ import annotations

from typing import Any


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
