"""The code behind the estimators. What they do, they do when they are taught; otherwise they answer the mean."""

import os
import time

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


def _estimator(teach):
    return lambda *, kind, seed, threads: Mean(teach)


def _raise():
    raise RuntimeError("out of breath\nand of words")


def _hang():
    while True:
        time.sleep(3600)


def _eat():
    eaten = []
    while True:
        eaten.append(np.ones(2**20))


def _built(first):
    """Return what does something when it is built, and answers honestly."""

    def build(*, kind, seed, threads):
        first()
        return Mean()

    return build


evil_built_elsewhere = _built(lambda: os.chdir("/"))
evil_raise = _estimator(_raise)
evil_abort = _estimator(os.abort)
evil_hang = _estimator(_hang)
evil_eat = _estimator(_eat)
