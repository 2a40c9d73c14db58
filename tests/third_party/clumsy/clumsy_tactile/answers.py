"""The code behind them."""

import itertools

import numpy as np

from tactbench.plugin import NotApplicable


class Constant:
    """Answers a number, and fails from a given fit on."""

    fits = itertools.count(1)

    def __init__(self, fails_from=None, wavers=False):
        self.fails_from, self.wavers, self.answer = fails_from, wavers, 0

    def fit(self, X, y):
        number = next(Constant.fits) if self.fails_from or self.wavers else 0
        if self.fails_from and number >= self.fails_from:
            raise RuntimeError("out of breath")
        self.answer = float(number) if self.wavers else y[0]
        return self

    def predict(self, X):
        return np.full(len(X), self.answer)


def breaks(*, kind, seed, threads):
    return Constant(fails_from=1)


def tires(*, kind, seed, threads):
    return Constant(fails_from=3)


def lacks(*, kind, seed, threads):
    raise NotApplicable("needs a licence that nobody has")


def wavers(*, kind, seed, threads):
    return Constant(wavers=True)
