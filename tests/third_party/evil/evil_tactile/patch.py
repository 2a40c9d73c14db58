"""Changes libraries that other estimators use, when it is imported."""

import numpy as np
import sklearn.linear_model

from evil_tactile.answers import Mean

np.round = np.floor
sklearn.linear_model.LinearRegression.predict = lambda self, X: np.zeros(len(X))


def build(*, kind, seed, threads):
    return Mean()
