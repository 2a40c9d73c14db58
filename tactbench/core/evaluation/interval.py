"""The interval of a score: over sessions, or over blocks of time where there are too few sessions."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.metrics import Metric, confusion
from tactbench.core.evaluation.time_blocks import RESAMPLES, block_length, circular_blocks
from tactbench.core.samples import FloatArray, IntArray

LEVEL = 0.95
ENOUGH_UNITS = 5
"""Fewer than this cannot be resampled: the interval would be their range."""
NOT_ONE = float(np.sqrt(2.0))
"""Standard error of the log-odds of half an error in n rows: where not one was wrong, more may not be known."""
FURTHEST = 10.0
"""An error's interval ends at so many times the error itself: few replicates may put no upper bound to it."""
_MOST_FREEDOM = 1e9
"""Degrees of freedom beyond which t is normal to all digits."""


@dataclass(frozen=True)
class Interval:
    """Where a score may lie, and how that was found."""

    low: float
    high: float
    method: str


@dataclass(frozen=True)
class ReplicateUnits:
    """What was repeated: sessions, groups or recordings."""

    name: str
    """What one of them is called: session, object …"""
    codes: IntArray
    """(n,) which one each row belongs to"""
    labels: tuple[str, ...]
    """What each is called, by its code"""
    caveat: str = ""
    """What an interval over them does not know; added to how it was found"""

    def sums(self, rows: FloatArray) -> FloatArray:
        """Return (units, m) sums of (n, m) summands over the rows of each."""
        out = np.zeros((int(self.codes.max()) + 1, rows.shape[1]))
        np.add.at(out, self.codes, rows)
        return out

    def enough(self, y: npt.NDArray[Any], n_classes: int) -> bool:
        """Tell whether there are enough of them to resample, of every class that occurs in (n,) labels."""
        each = [y == one for one in range(n_classes)]
        own = [self.codes, *(self.codes[mask] for mask in each if mask.any())]
        return all(len(np.unique(codes)) >= ENOUGH_UNITS for codes in own)

    def strata(self, y: npt.NDArray[Any], n_classes: int) -> IntArray:
        """Return (units,) numbers, equal for units that may stand in for each other.

        All of them, or class by class where each has one class only: without it a resample could lose a class, and its
        score would be that of another question.
        """
        there = np.zeros((int(self.codes.max()) + 1, max(n_classes, 1)), dtype=bool)
        there[self.codes, y if n_classes else 0] = True
        if (there.sum(axis=1) > 1).any():
            return np.zeros(len(there), dtype=np.int64)
        return np.unique(there.argmax(axis=1), return_inverse=True)[1].astype(np.int64)


def score_interval(
    metric: Metric,
    y: npt.NDArray[Any],
    predicted: npt.NDArray[Any],
    recording: IntArray,
    unit: ReplicateUnits,
    n_classes: int,
    seed: int,
) -> Interval:
    """Return the interval of ``metric.of(y, predicted)``; rows of a recording are in time order.

    Notes
    -----
    With at least five units, each is left out in turn, those of one class standing in for each other only, and the
    interval is Student's over units [1]_, on a scale that suits the metric (:func:`transform_of`). Percentiles of
    resampled units cover less than they say where there are few: ``benchmarks/coverage.py``. One wrong answer or none
    does not tell how units differ: the lower end is then at most that of n units right out of n [2]_, however many rows
    they have; of one right answer or none, the upper end alike. With fewer units, or when a class is in fewer than
    five, time is resampled instead: circular blocks within each recording, whose length follows from the
    autocorrelation of the loss (`time_blocks`). Such an interval knows nothing of the spread between sessions and says
    so.

    References
    ----------
    .. [1] Cameron, Gelbach and Miller 2008, Bootstrap-based improvements for inference with clustered errors.
    .. [2] Clopper and Pearson 1934, The use of confidence or fiducial limits illustrated in the case of the binomial.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0xC1]))  # the same blocks for every figure of a cell
    rows = metric.rows(y, predicted, n_classes)
    if unit.enough(y, n_classes):
        return _of_units(metric, rows, y, unit, n_classes)
    if len(np.unique(recording)) == len(recording):
        return _of_too_few(metric, rows, n_classes)
    total = np.zeros((RESAMPLES, rows.shape[1]))
    lengths, sizes = [], []
    for one in np.unique(recording):
        mine = recording == one
        length = block_length(loss_of(metric, y[mine], predicted[mine]))
        lengths.append(length)
        sizes.append(int(mine.sum()) / length)
        total += circular_blocks(rows[mine], length, rng)
    spread = f"{min(lengths)}" if min(lengths) == max(lengths) else f"{min(lengths)}–{max(lengths)}"
    many = f"{len(lengths)} recording" + ("s" if len(lengths) > 1 else "")
    method = f"block bootstrap in time within {many} (blocks of {spread} rows): spread between sessions is not in it"
    score = float(metric.score(rows.sum(axis=0), n_classes))
    scale = transform_of(metric.name, score, len(y))
    resampled = scale.there(metric.score(total, n_classes))
    resampled = resampled[np.isfinite(resampled)]  # R² of a resample whose labels are all alike
    freedom = max(sum(sizes) - len(lengths), 1.0)
    widened = np.sqrt(sum(sizes) / freedom)  # a variance of so many blocks is that much too small
    return _student(metric, score, float(resampled.std()) * widened, freedom, scale, method)


def _of_units(metric: Metric, rows: FloatArray, y: npt.NDArray[Any], unit: ReplicateUnits, n_classes: int) -> Interval:
    """Return Student's interval over units, from what leaving each out changes."""
    sums, strata = unit.sums(rows), unit.strata(y, n_classes)
    score = float(metric.score(sums.sum(axis=0), n_classes))
    scale = transform_of(metric.name, score, len(y))
    without = scale.there(metric.score(sums.sum(axis=0) - sums, n_classes))
    without = np.where(np.isfinite(without), without, scale.there(score))  # R² of labels that are all alike
    freedom = len(sums) - len(np.unique(strata))
    over = f"{len(sums)} {plural(unit.name)}"
    method = f"jackknife over {over} (Student's t, {freedom} degrees of freedom, {scale.name}){unit.caveat}"
    deviation = float(np.sqrt((influences(without, strata) ** 2).sum()))
    found = _student(metric, score, deviation, freedom, scale, method)
    if metric.kind == "regression":
        return found
    right, least = np.trace(confusion(sums.sum(axis=0), n_classes)), (0.5 - LEVEL / 2) ** (1 / len(sums))
    alike = f"{method}; no surer than {over} all alike (Clopper and Pearson)"
    if rows.sum() - right <= 1:
        return Interval(min(found.low, least), found.high, alike)
    return Interval(found.low, max(found.high, 1 - least), alike) if right <= 1 else found


def _student(
    metric: Metric, score: float, deviation: float, freedom: float, scale: ScoreTransform, method: str
) -> Interval:
    """Return Student's interval of a score whose standard error on `scale` is `deviation`."""
    if metric.kind != "regression" and score in (0.0, 1.0):
        deviation = NOT_ONE
    reach = float(student_quantile(freedom)) * deviation
    ends = [float(scale.back(scale.there(score) + one * reach)) for one in (-1.0, 1.0)]
    return Interval(min(*ends, score), max(*ends, score), method)


def _of_too_few(metric: Metric, rows: FloatArray, n_classes: int) -> Interval:
    """Return what a few rows, each a recording of its own, cannot exclude: there is no time to resample in them."""
    method = f"none: {len(rows)} recordings of one row each are too few to resample; the range of what is possible"
    if metric.kind != "regression":
        return Interval(0.0, 1.0, method)
    each = metric.score(rows, n_classes)
    if not np.isfinite(each).all():  # R² of one row is undefined
        each = metric.score(rows.sum(axis=0), n_classes)
    return Interval(float(each.min()), float(each.max()), method)


def plural(name: str) -> str:
    """Return the name of several units."""
    return name + ("es" if name.endswith("s") else "s")


def loss_of(metric: Metric, y: npt.NDArray[Any], predicted: npt.NDArray[Any]) -> FloatArray:
    """Return (n,) what each row adds to the error: its square, or whether the class is wrong."""
    if metric.kind != "regression":
        return np.asarray(y != predicted, dtype=np.float64)
    squares = (predicted - y) ** 2
    return np.asarray(squares.sum(axis=1)) if metric.vector else squares


def student_quantile(freedom: Any) -> FloatArray:
    """Return how many standard errors a two-sided interval of 95 % reaches, for each of some degrees of freedom."""
    special = importlib.import_module("scipy.special")
    return np.asarray(special.stdtrit(np.minimum(freedom, _MOST_FREEDOM), 0.5 + LEVEL / 2))


def two_sided_p(t: float, freedom: float) -> float:
    """Return the probability of a value at least as far from 0 as `t`."""
    special = importlib.import_module("scipy.special")
    return float(2 * special.stdtr(min(freedom, _MOST_FREEDOM), -abs(t)))


def influences(without: FloatArray, strata: IntArray) -> FloatArray:
    """Return (…, replicates) whose sum of squares is the squared standard error of a score.

    Parameters
    ----------
    without
        (…, replicates) the score without each replicate.
    strata
        (replicates,) which replicates may stand in for each other; two or more of each.

    Notes
    -----
    The jackknife of Quenouille and Tukey, within strata as in Shao and Tu 1995, The jackknife and bootstrap, section
    6.2. For a mean over replicates this is the usual standard error exactly, and no derivative of a metric is needed.
    """
    out = np.zeros_like(without)
    for one in np.unique(strata):
        mine = without[..., strata == one]
        n = mine.shape[-1]
        out[..., strata == one] = np.sqrt((n - 1) / n) * (mine.mean(axis=-1, keepdims=True) - mine)
    return out


@dataclass(frozen=True)
class ScoreTransform:
    """A monotone function of a score, and its inverse."""

    name: str
    there: Callable[[Any], Any]
    back: Callable[[Any], Any]


def transform_of(metric: str, score: float, n: int) -> ScoreTransform:
    """Return the scale of a metric on which Student's interval is to be made.

    No error's interval reaches beyond ten times its `score`; a share of `n` rows is never nearer to 0 or 1 than half
    of one.

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
