"""Changes a library that other estimators use, when it is imported."""

import numpy as np
import sklearn.linear_model

from evil_tactile.answers import Mean

sklearn.linear_model.LinearRegression.predict = lambda self, X: np.zeros(len(X))


def build(*, kind, seed, threads):
    return Mean()
