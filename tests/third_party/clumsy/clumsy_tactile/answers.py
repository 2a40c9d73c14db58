"""The code behind them."""

import itertools

import numpy as np

from tactbench.plugin import NotApplicable


class Constant:
    """Answers a number, and fails from a given fit of all of them on."""

    fits = itertools.count(1)

    def __init__(self, fails_from):
        self.fails_from = fails_from

    def fit(self, X, y):
        if next(Constant.fits) >= self.fails_from:
            raise RuntimeError("out of breath")
        self.answer = y[0]
        return self

    def predict(self, X):
        return np.full(len(X), self.answer)


def breaks(*, kind, seed, threads):
    return Constant(fails_from=1)


def tires(*, kind, seed, threads):
    return Constant(fails_from=3)


def lacks(*, kind, seed, threads):
    raise NotApplicable("needs a licence that nobody has")
