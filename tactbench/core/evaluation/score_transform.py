"""On which scale a score of few replicates is about as far above the truth as below it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

FURTHEST = 10.0
"""An error's interval ends at so many times the error itself: few replicates may put no upper bound to it."""


@dataclass(frozen=True)
class ScoreTransform:
    """A monotone function of a score, and its inverse."""

    name: str
    there: Callable[[Any], Any]
    back: Callable[[Any], Any]


def transform_of(metric: str, score: float, n: int) -> ScoreTransform:
    """Return the scale of a metric on which Student's interval is to be made.

    Parameters
    ----------
    score
        What was scored; no error's interval reaches beyond ten times as much.
    n
        Test rows: a share is never nearer to 0 or 1 than half of one.

    Notes
    -----
    A mean of squares from few sessions that is too low also looks too certain, and the reverse, so that Student's
    interval of it misses a large truth too often; that of its reciprocal does not. Shares near 0 or 1 have no room on
    one side: their logarithmic odds have (Agresti 2013, Categorical data analysis, section 3.1). Both are measured in
    ``benchmarks/coverage.py``.
    """
    if metric in ("rmse", "mae", "mean_euclidean_error"):
        least = max(score, np.finfo(np.float64).tiny ** 0.5) / 1e3
        return ScoreTransform(
            "reciprocal scale",
            lambda x: 1.0 / np.maximum(x, least),
            lambda x: 1.0 / np.maximum(x, 1.0 / (FURTHEST * max(score, least))),
        )
    if metric == "r2":
        return ScoreTransform(
            "scale of log(1 − R²)", lambda x: np.log(np.maximum(1.0 - x, 0.5 / n)), lambda x: 1.0 - np.exp(x)
        )
    edge = 0.5 / n

    def odds(x: Any) -> Any:
        inside = np.clip(x, edge, 1.0 - edge)
        return np.log(inside / (1.0 - inside))

    return ScoreTransform("scale of log-odds", odds, lambda x: 1.0 / (1.0 + np.exp(-x)))
