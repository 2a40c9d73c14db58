"""A small neural network."""

from __future__ import annotations

from tactbench.estimators.target import OfUnitSpread
from tactbench.plugin import Estimator


def perceptron(*, kind: str, seed: int, threads: int, hidden: int, alpha: float, max_iter: int) -> Estimator:
    """Return one hidden layer of `hidden` rectified units, taught by Adam (Kingma and Ba 2015).

    A tenth of the training rows, drawn by the seed, says when to stop: ten epochs without gain. Its rows have
    neighbours one sample away among the others, so that it ends the training but does not choose well for another
    session; `max_iter` epochs are the most.
    """
    from sklearn.neural_network import MLPClassifier, MLPRegressor

    settings = {
        "hidden_layer_sizes": (hidden,), "alpha": alpha, "max_iter": max_iter, "early_stopping": True,
        "random_state": seed,
    }  # fmt: skip
    return MLPClassifier(**settings) if kind == "classification" else OfUnitSpread(MLPRegressor(**settings))
