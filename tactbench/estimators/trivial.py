"""Baseline estimators whose predictions do not depend on the features."""

from __future__ import annotations

from typing import Any


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
