"""What the descriptors name."""

import numpy as np

from tactbench.plugin import ForcePath, Source
from tactbench.plugin.simulation import Reason

KEPT = []


class Ridge:
    def __init__(self, alpha, rows):
        self.alpha, self.rows = alpha, rows

    def fit(self, X, y):
        assert isinstance(self.rows, int)
        self.middle, self.level = X.mean(axis=0), y.mean()
        spread = X.std(axis=0)
        self.scale = np.where(spread > 0, spread, 1.0)
        Z = (X - self.middle) / self.scale
        self.weights = np.linalg.solve(Z.T @ Z + self.alpha * np.eye(X.shape[1]), Z.T @ (y - self.level))
        return self

    def predict(self, X):
        return self.level + (X - self.middle) / self.scale @ self.weights


def build(*, kind, seed, threads, alpha, rows, solver):
    return Ridge(alpha, rows)


def called_for(scene, sensor):
    return Reason(False, "only by name", 0.0)


def apply(run):
    for track in run.tracks:
        track.readings += 0.01 * run.of_recording("ripple", *track.scope).standard_normal(track.readings.shape)


def height(x_mm, y_mm, *, size):
    return (x_mm**2 + y_mm**2) / (2 * size)


def push(*, peak):
    return ForcePath(times_s=(0, 1, 2), forces_n=(0, 0, peak), samples=20, source=Source(tag="assumed", reference="t"))
