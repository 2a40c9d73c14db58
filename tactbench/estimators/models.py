"""Regressors and classifiers: trivial and linear models, forests, boosting, neighbours, kernels, a neural network."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.plugin import Estimator, FloatArray


def mean(*, kind: str, seed: int, threads: int) -> Any:
    """Return a regressor that always predicts the mean of the training labels."""
    from sklearn.dummy import DummyRegressor

    return DummyRegressor(strategy="mean")


def majority(*, kind: str, seed: int, threads: int) -> Any:
    """Return a classifier that always predicts the most frequent class of the training data."""
    from sklearn.dummy import DummyClassifier

    return DummyClassifier(strategy="most_frequent")


def chance(*, kind: str, seed: int, threads: int) -> Any:
    """Return a classifier that draws each prediction uniformly from the training classes, with a fixed seed."""
    from sklearn.dummy import DummyClassifier

    return DummyClassifier(strategy="uniform", random_state=seed)


class Wrapped:
    """An estimator that contains another estimator (`model`) and returns that estimator's predictions."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return the (n,) predictions for the features X (n, p)."""
        return np.asarray(self.model.predict(X))


class Forest(Wrapped):
    """A forest whose predictions do not depend on the timing of threads.

    scikit-learn adds up the trees in the order in which its threads finish them, so that the last bits of a mean change
    from run to run. Here each thread predicts rows of its own and adds the trees in order; a single row is predicted
    without threads.
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
        """Return the (n,) predictions for the features X (n, p)."""
        if self.threads == 1 or len(X) < 100 * self.threads:
            return super().predict(X)
        with ThreadPoolExecutor(self.threads) as pool:
            return np.concatenate(list(pool.map(self.model.predict, np.array_split(X, self.threads))))


def forest(*, kind: str, seed: int, threads: int, **params: Any) -> Estimator:
    """Return scikit-learn's random forest (Breiman 2001); Karl et al. 2016 use 500 trees for the curvature task."""
    from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor

    make = RandomForestClassifier if kind == "classification" else RandomForestRegressor
    return Forest(make(random_state=seed, **params), threads)


def extra_trees(*, kind: str, seed: int, threads: int, **params: Any) -> Estimator:
    """Return scikit-learn's extremely randomised trees (Geurts, Ernst and Wehenkel 2006)."""
    from sklearn.ensemble import ExtraTreesClassifier, ExtraTreesRegressor

    make = ExtraTreesClassifier if kind == "classification" else ExtraTreesRegressor
    return Forest(make(random_state=seed, **params), threads)


def boosting(*, kind: str, seed: int, threads: int, **params: Any) -> Any:
    """Return scikit-learn's gradient boosting (Friedman 2001) of trees on histograms (Ke et al. 2017).

    A round grows one tree, or one for each class. Training never stops early: the criterion would be the score on a
    random tenth of the rows, which have neighbours one sample away among the others and so do not show the error in
    another session. The framework limits the number of OpenMP threads.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor

    make = HistGradientBoostingClassifier if kind == "classification" else HistGradientBoostingRegressor
    return make(early_stopping=False, random_state=seed, **params)


class Neighbours(Wrapped):
    """Nearest-neighbour estimator that uses all training rows if there are fewer than `n_neighbors`."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Neighbours:
        """Store the training features X (n, p) and labels y (n,)."""
        self.model.set_params(n_neighbors=min(self.model.n_neighbors, len(X))).fit(X, y)
        return self


def neighbours(*, kind: str, seed: int, threads: int, **params: Any) -> Estimator:
    """Return an estimator that predicts the vote, or the mean, of the `n_neighbors` nearest rows with equal weights.

    Fifteen neighbours (assumed): neighbours in feature space are mostly consecutive samples; at 100 Hz five of them
    cover a twentieth of a second and contain the same value of the slow noise.
    """
    from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor

    make = KNeighborsClassifier if kind == "classification" else KNeighborsRegressor
    return Neighbours(make(n_jobs=threads, **params))


class OfUnitSpread(Wrapped):
    """A regressor trained on y scaled to zero mean and unit standard deviation; it predicts in y's own unit.

    The width of a support-vector tube and the step of a gradient are numbers in the target's unit: without scaling,
    the quality of a fit would depend on the unit, for example on newtons or 1/mm.
    """

    def __init__(self, model: Any) -> None:
        super().__init__(model)
        self.mean, self.spread = 0.0, 1.0

    def fit(self, X: FloatArray, y: FloatArray) -> OfUnitSpread:
        """Fit the scaled targets y (n,) to the features X (n, p)."""
        self.mean, self.spread = float(y.mean()), float(y.std()) or 1.0
        self.model.fit(X, (y - self.mean) / self.spread)
        return self

    def predict(self, X: FloatArray) -> FloatArray:
        """Return the (n,) predictions for the features X (n, p), in the unit of y."""
        answers: FloatArray = self.mean + self.spread * self.model.predict(X)
        return answers


class EveryNth(Wrapped):
    """An estimator trained on every n-th row, with n such that at most `rows` rows are used, to limit computing time.

    Rows that follow each other in time are nearly equal, so that every n-th row loses less than a random selection.
    """

    def __init__(self, model: Any, rows: int) -> None:
        super().__init__(model)
        self.rows = rows

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> EveryNth:
        """Fit every n-th label of y (n,) to the same rows of X (n, p)."""
        step = -(-len(X) // self.rows)
        self.model.fit(X[::step], y[::step])
        return self


def support_vectors(*, kind: str, seed: int, threads: int, rows: int, **params: Any) -> Estimator:
    """Return libsvm's support vector machine (Cortes and Vapnik 1995) with a Gaussian kernel.

    Classes are compared in pairs; for numbers, the tube is 0.1 standard deviations of y wide. ``gamma="scale"`` is
    1 / (number of features * their variance).
    """
    from sklearn.svm import SVC, SVR

    model = SVC(**params) if kind == "classification" else OfUnitSpread(SVR(epsilon=0.1, **params))
    return EveryNth(model, rows)


def perceptron(*, kind: str, seed: int, threads: int, hidden: int, **params: Any) -> Estimator:
    """Return a neural network with one hidden layer of `hidden` rectified units, trained by Adam (Kingma and Ba 2015).

    Training ends after ten epochs without a better score on a tenth of the training rows, drawn by the seed, or after
    `max_iter` epochs. These rows have neighbours one sample away among the others, so that their score ends the
    training but does not show the error in another session.
    """
    from sklearn.neural_network import MLPClassifier, MLPRegressor

    settings = {"hidden_layer_sizes": (hidden,), "early_stopping": True, "random_state": seed, **params}
    return MLPClassifier(**settings) if kind == "classification" else OfUnitSpread(MLPRegressor(**settings))


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
