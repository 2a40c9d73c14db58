"""The code behind the estimators. What they do, they do when they are taught; otherwise they answer the mean."""

import os

import numpy as np


class Mean:
    """Answers the mean of what it was taught, or the first class."""

    def __init__(self, teach=None):
        self.teach = teach

    def fit(self, X, y):
        self.value = y[0] if y.dtype.kind in "iu" else float(np.mean(y))
        if self.teach is not None:
            self.teach()
        return self

    def predict(self, X):
        return np.full(len(X), self.value)


def _raise():
    raise RuntimeError("out of breath\nand of words")


def _eat():
    eaten = []
    while True:
        eaten.append(np.ones(2**20))


def evil_raise(*, kind, seed, threads):
    return Mean(_raise)


def evil_abort(*, kind, seed, threads):
    return Mean(os.abort)


def evil_eat(*, kind, seed, threads):
    return Mean(_eat)


def evil_latin(*, kind, seed, threads):
    """Look for a file whose name is no UTF-8."""
    print("\udce9")
    raise ValueError("sh\udce9lf/levels.txt is not there")
