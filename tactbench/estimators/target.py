"""A target without a unit, for learners whose parameters are in units of the target."""

from __future__ import annotations

from typing import Any

from tactbench.plugin import FloatArray


class OfUnitSpread:
    """A regressor taught y less its mean, over its standard deviation; it answers in y's own unit.

    The width of a support-vector tube and the step of a gradient are numbers in the target's unit: without this a
    force in newtons and a curvature in 1/mm would be learned differently well.
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self.mean, self.spread = 0.0, 1.0

    def fit(self, X: FloatArray, y: FloatArray) -> OfUnitSpread:
        """Learn y (n,) from X (n, p)."""
        self.mean, self.spread = float(y.mean()), float(y.std()) or 1.0
        self.model.fit(X, (y - self.mean) / self.spread)
        return self

    def predict(self, X: FloatArray) -> FloatArray:
        """Return (n,) answers to X (n, p), in the unit of y."""
        answers: FloatArray = self.mean + self.spread * self.model.predict(X)
        return answers
