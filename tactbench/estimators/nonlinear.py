"""Forests, boosting, neighbours, support vectors and a small neural network."""

from __future__ import annotations

import warnings
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.plugin import Estimator, FloatArray, NotApplicable


class Wrapped:
    """An estimator around another one, which answers for it."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n,) answers to X (n, p)."""
        return np.asarray(self.model.predict(X))


class Forest(Wrapped):
    """A forest whose predictions do not depend on the timing of threads.

    scikit-learn adds up the trees in the order in which its threads finish them, so that the last bits of a mean change
    from run to run. Here each thread answers rows of its own and adds the trees in order; a single row is answered
    without any thread.
    """

    def __init__(self, model: Any, threads: int) -> None:
        super().__init__(model)
        self.threads = threads

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Forest:
        """Grow the trees on X (n, p) and y (n,)."""
        self.model.set_params(n_jobs=self.threads).fit(X, y)
        self.model.set_params(n_jobs=1)
        return self

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return (n,) answers to X (n, p)."""
        if self.threads == 1 or len(X) < 100 * self.threads:
            return super().predict(X)
        with ThreadPoolExecutor(self.threads) as pool:
            return np.concatenate(list(pool.map(self.model.predict, np.array_split(X, self.threads))))


def forest(*, kind: str, seed: int, threads: int, **params: Any) -> Estimator:
    """Return a random forest (Breiman 2001), as scikit-learn builds it; the paper's curvature forest has 500 trees."""
    from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor

    make = RandomForestClassifier if kind == "classification" else RandomForestRegressor
    return Forest(make(random_state=seed, **params), threads)


def extra_trees(*, kind: str, seed: int, threads: int, **params: Any) -> Estimator:
    """Return extremely randomised trees (Geurts, Ernst and Wehenkel 2006), as scikit-learn builds them."""
    from sklearn.ensemble import ExtraTreesClassifier, ExtraTreesRegressor

    make = ExtraTreesClassifier if kind == "classification" else ExtraTreesRegressor
    return Forest(make(random_state=seed, **params), threads)


class FastForest(Wrapped):
    """A forest that raises an error when scikit-learn-intelex falls back to plain scikit-learn.

    The library does so silently for parameters that oneDAL does not support (more than 6024 trees, some criteria and
    weights). A row under this name would then be one of the plain forest.
    """

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> FastForest:
        """Grow the trees on X (n, p) and y (n,).

        Raises
        ------
        NotApplicable
            If oneDAL did not do it.
        """
        # daal4py compares versions with distutils: nothing a user could do, and nothing about the data.
        with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
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
        return super().predict(X).reshape(len(X))


def fast_forest(*, kind: str, seed: int, threads: int, **params: Any) -> Estimator:
    """Return a random forest by oneDAL through scikit-learn-intelex: another implementation of the same idea.

    It bins features (256 bins) before it splits, and draws otherwise, so that its trees are not the same trees.

    Raises
    ------
    NotApplicable
        If the extra is not installed.
    """
    try:
        with warnings.catch_warnings(action="ignore", category=DeprecationWarning):
            from sklearnex.ensemble import RandomForestClassifier, RandomForestRegressor
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "sklearnex":
            raise  # it is there, and broken
        raise NotApplicable("needs the extra: pip install 'tactbench[fast]' (x86-64 only)") from error
    make = RandomForestClassifier if kind == "classification" else RandomForestRegressor
    return FastForest(make(random_state=seed, n_jobs=threads, **params))


def boosting(*, kind: str, seed: int, threads: int, **params: Any) -> Any:
    """Return gradient boosting (Friedman 2001) of trees on histograms (Ke et al. 2017), as scikit-learn does it.

    A round grows one tree, or one for each class. It never stops early: a tenth of the rows drawn at random would each
    have a neighbour one sample away among the other nine, and say nothing about another session. Threads are OpenMP's,
    which the core limits.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor

    make = HistGradientBoostingClassifier if kind == "classification" else HistGradientBoostingRegressor
    return make(early_stopping=False, random_state=seed, **params)


class Neighbours(Wrapped):
    """Nearest neighbours that use all rows where there are fewer than `n_neighbors`."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Neighbours:
        """Keep X (n, p) and y (n,)."""
        self.model.set_params(n_neighbors=min(self.model.n_neighbors, len(X))).fit(X, y)
        return self


def neighbours(*, kind: str, seed: int, threads: int, n_neighbors: int) -> Estimator:
    """Return the vote, or the mean, of the `n_neighbors` nearest rows; all count alike.

    Fifteen (assumed): neighbours in feature space are mostly samples that followed each other; at 100 Hz five of them
    are a twentieth of a second and carry one draw of the slow noise.
    """
    from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor

    make = KNeighborsClassifier if kind == "classification" else KNeighborsRegressor
    return Neighbours(make(n_neighbors=n_neighbors, n_jobs=threads))


class OfUnitSpread(Wrapped):
    """A regressor trained on y scaled to zero mean and unit standard deviation; it predicts in y's own unit.

    The width of a support-vector tube and the step of a gradient are numbers in the target's unit: without this a
    force in newtons and a curvature in 1/mm would be learned differently well.
    """

    def __init__(self, model: Any) -> None:
        super().__init__(model)
        self.mean, self.spread = 0.0, 1.0

    def fit(self, X: FloatArray, y: FloatArray) -> OfUnitSpread:
        """Learn y (n,) from X (n, p)."""
        self.mean, self.spread = float(y.mean()), float(y.std()) or 1.0
        self.model.fit(X, (y - self.mean) / self.spread)
        return self

    def predict(self, X: FloatArray) -> FloatArray:
        """Return (n,) answers to X (n, p), in the unit of y."""
        answers: FloatArray = self.mean + self.spread * self.model.predict(X)
        return answers


class EveryNth(Wrapped):
    """An estimator trained on every n-th row, n such that at most `rows` are left: its fit grows faster than the rows.

    Rows that follow each other in time are nearly copies, so that every n-th one leaves out less than a random draw.
    """

    def __init__(self, model: Any, rows: int) -> None:
        super().__init__(model)
        self.rows = rows

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> EveryNth:
        """Learn y (n,) from X (n, p)."""
        step = -(-len(X) // self.rows)
        self.model.fit(X[::step], y[::step])
        return self


def support_vectors(*, kind: str, seed: int, threads: int, C: float, gamma: float | str, rows: int) -> Estimator:
    """Return a support vector machine (Cortes and Vapnik 1995) with a Gaussian kernel, as libsvm finds it.

    One against one for classes, a tube of 0.1 of y's deviation for numbers. ``gamma="scale"`` is one over (features
    times their variance): the width of the cloud itself.
    """
    from sklearn.svm import SVC, SVR

    model = SVC(C=C, gamma=gamma) if kind == "classification" else OfUnitSpread(SVR(C=C, gamma=gamma, epsilon=0.1))
    return EveryNth(model, rows)


def perceptron(*, kind: str, seed: int, threads: int, hidden: int, alpha: float, max_iter: int) -> Estimator:
    """Return one hidden layer of `hidden` rectified units, taught by Adam (Kingma and Ba 2015).

    A tenth of the training rows, drawn by the seed, determines the end: ten epochs without gain. Its rows have
    neighbours one sample away among the others, so that it ends the training but does not choose well for another
    session; `max_iter` epochs are the most.
    """
    from sklearn.neural_network import MLPClassifier, MLPRegressor

    settings = {
        "hidden_layer_sizes": (hidden,), "alpha": alpha, "max_iter": max_iter, "early_stopping": True,
        "random_state": seed,
    }  # fmt: skip
    return MLPClassifier(**settings) if kind == "classification" else OfUnitSpread(MLPRegressor(**settings))
