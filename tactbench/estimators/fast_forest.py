"""Random forests by oneDAL through scikit-learn-intelex: the same idea, another implementation, an extra.

It is never swapped in for scikit-learn's: whoever wants it names it. It bins features (256 bins) before it splits, and
draws otherwise, so that its trees are not the same trees.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.plugin import Estimator, FloatArray, NotApplicable


class FastForest:
    """A forest that says so when scikit-learn-intelex hands the work back to plain scikit-learn.

    It does that in silence for what oneDAL cannot do (more than 6024 trees, some criteria and weights). A row under
    this name would then be one of the plain forest.
    """

    def __init__(self, model: Any) -> None:
        self.model = model

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> FastForest:
        """Grow the trees on X (n, p) and y (n,).

        Raises
        ------
        NotApplicable
            If oneDAL did not do it.
        """
        with _its_own_deprecations_unheard():
            self.model.fit(X, y)
        if not hasattr(self.model, "_onedal_estimator"):
            raise NotApplicable(
                f"scikit-learn-intelex does not accelerate a forest with these parameters "
                f"(n_estimators={self.model.n_estimators}): it fell back to plain scikit-learn.",
                hint="Use the estimator `forest`.",
            )
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n,) answers to X (n, p)."""
        return np.asarray(self.model.predict(X)).reshape(len(X))


def fast_forest(
    *, kind: str, seed: int, threads: int, n_estimators: int, max_depth: int | None, min_samples_leaf: int
) -> Estimator:
    """Return a forest of `n_estimators` trees.

    Raises
    ------
    NotApplicable
        If the extra is not installed.
    """
    try:
        with _its_own_deprecations_unheard():
            from sklearnex.ensemble import RandomForestClassifier, RandomForestRegressor
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "sklearnex":
            raise  # it is there, and broken
        raise NotApplicable("needs the extra: pip install 'tactbench[fast]' (x86-64 only)") from error
    make = RandomForestClassifier if kind == "classification" else RandomForestRegressor
    return FastForest(
        make(n_estimators=n_estimators, max_depth=max_depth, min_samples_leaf=min_samples_leaf, random_state=seed,
             n_jobs=threads)
    )  # fmt: skip


@contextmanager
def _its_own_deprecations_unheard() -> Iterator[None]:
    """Leave out that daal4py compares versions with distutils: nothing a user could do, and nothing about the data."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="distutils Version classes", category=DeprecationWarning)
        yield
