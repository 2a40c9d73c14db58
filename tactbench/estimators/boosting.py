"""Gradient boosting (Friedman 2001) of trees that split histograms (Ke et al. 2017), as scikit-learn does it."""

from __future__ import annotations

from typing import Any


def boosting(*, kind: str, seed: int, threads: int, max_iter: int, learning_rate: float, max_leaf_nodes: int) -> Any:
    """Return `max_iter` rounds of boosting; a round grows one tree, or one for each class.

    It never stops early: a tenth of the rows drawn at random would each have a neighbour one sample away among the
    other nine, and say nothing about another session. Threads are OpenMP's, which the core limits.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor

    make = HistGradientBoostingClassifier if kind == "classification" else HistGradientBoostingRegressor
    return make(max_iter=max_iter, learning_rate=learning_rate, max_leaf_nodes=max_leaf_nodes, early_stopping=False,
                random_state=seed)  # fmt: skip
