"""The interval of a score: over sessions, or over blocks of time where there are too few sessions."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.jackknife import influences
from tactbench.core.evaluation.metrics import Metric
from tactbench.core.evaluation.score_transform import ScoreTransform, transform_of
from tactbench.core.samples import FloatArray, IntArray

LEVEL = 0.95
RESAMPLES = 2000
ENOUGH_CLUSTERS = 5
"""Fewer than this cannot be resampled: the interval would be their range."""
NOT_ONE = float(np.sqrt(2.0))
"""Standard error of the log-odds of half an error in n rows: where not one was wrong, more may not be known."""


@dataclass(frozen=True)
class Interval:
    """Where a score may lie, and how that was found."""

    low: float
    high: float
    method: str


def score_interval(
    metric: Metric,
    y: npt.NDArray[Any],
    predicted: npt.NDArray[Any],
    recording: IntArray,
    cluster: npt.NDArray[Any],
    cluster_name: str,
    n_classes: int,
    seed: int,
) -> Interval:
    """Return the interval of ``metric.of(y, predicted)``.

    Parameters
    ----------
    y, predicted, recording, cluster
        (n,) truth, prediction, recording and unit of replication of each test row, rows of a recording in time order.
    cluster_name
        What a cluster is, for the text.

    Notes
    -----
    With at least five clusters, each is left out in turn, those of one class standing in for each other only, and the
    interval is Student's over clusters [4]_, on a scale that suits the metric (:func:`transform_of`). Percentiles of
    resampled clusters cover less than they say where there are few: ``benchmarks/coverage.py``. With fewer clusters, or
    when a class is in fewer than five, time is resampled instead: circular blocks within each recording [1]_, whose
    length follows from the autocorrelation of the loss [2]_ [3]_. Such an interval knows nothing of the spread between
    sessions and says so.

    References
    ----------
    .. [1] Politis and Romano 1992, A circular block-resampling procedure for stationary data.
    .. [2] Politis and White 2004, Automatic block-length selection for the dependent bootstrap.
    .. [3] Patton, Politis and White 2009, correction to [2]_.
    .. [4] Cameron, Gelbach and Miller 2008, Bootstrap-based improvements for inference with clustered errors.
    """
    rng = generator(seed)
    rows = metric.rows(y, predicted, n_classes)
    names, number = np.unique(cluster, return_inverse=True)
    if enough(y, number, n_classes):
        sums = np.zeros((len(names), rows.shape[1]))
        np.add.at(sums, number, rows)
        strata = strata_of(y, number, n_classes)
        return _of_clusters(metric, sums, strata, cluster_name, n_classes, len(y))
    if len(np.unique(recording)) == len(recording):
        return _of_too_few(metric, rows, n_classes)
    total = np.zeros((RESAMPLES, rows.shape[1]))
    lengths, sizes = [], []
    for one in np.unique(recording):
        mine = rows[recording == one]
        loss = loss_of(metric, y[recording == one], predicted[recording == one])
        length = block_length(loss)
        lengths.append(length)
        sizes.append(len(mine) / length)
        total += circular_blocks(mine, length, rng)
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


def generator(seed: int) -> np.random.Generator:
    """Return what blocks of time are drawn with: the same blocks for every figure of a cell."""
    return np.random.default_rng(np.random.SeedSequence([seed, 0xC1]))


def _of_clusters(
    metric: Metric, sums: FloatArray, strata: list[IntArray], cluster_name: str, n_classes: int, n: int
) -> Interval:
    """Return Student's interval over clusters, from what leaving each out changes."""
    score = float(metric.score(sums.sum(axis=0), n_classes))
    scale = transform_of(metric.name, score, n)
    code = np.zeros(len(sums), dtype=np.int64)
    for place, one in enumerate(strata):
        code[one] = place
    without = scale.there(metric.score(sums.sum(axis=0) - sums, n_classes))
    without = np.where(np.isfinite(without), without, scale.there(score))  # R² of labels that are all alike
    freedom = len(sums) - len(strata)
    method = (
        f"jackknife over {len(sums)} {plural(cluster_name)} (Student's t, {freedom} degrees of freedom, {scale.name})"
    )
    deviation = float(np.sqrt((influences(without, code) ** 2).sum()))
    return _student(metric, score, deviation, freedom, scale, method)


def _student(
    metric: Metric, score: float, deviation: float, freedom: float, scale: ScoreTransform, method: str
) -> Interval:
    """Return Student's interval of a score whose standard error on `scale` is `deviation`."""
    if metric.kind != "regression" and score in (0.0, 1.0):
        deviation = NOT_ONE
    reach = student_reach(freedom) * deviation
    ends = [float(scale.back(scale.there(score) + one * reach)) for one in (-1.0, 1.0)]
    return Interval(min(*ends, score), max(*ends, score), method)


def student_reach(freedom: float) -> float:
    """Return how many standard errors Student's interval reaches to either side."""
    return float(importlib.import_module("scipy.special").stdtrit(freedom, 0.5 + LEVEL / 2))


def _of_too_few(metric: Metric, rows: FloatArray, n_classes: int) -> Interval:
    """Return what a few rows, each a recording of its own, cannot exclude: there is no time to resample in them."""
    method = f"none: {len(rows)} recordings of one row each are too few to resample; the range of what is possible"
    if metric.kind != "regression":
        return Interval(0.0, 1.0, method)
    each = metric.score(rows, n_classes)
    if not np.isfinite(each).all():  # R² of one row is undefined
        each = metric.score(rows.sum(axis=0), n_classes)
    return Interval(float(each.min()), float(each.max()), method)


def enough(y: npt.NDArray[Any], cluster: npt.NDArray[Any], n_classes: int) -> bool:
    """Tell whether there are enough clusters to resample, of every class that occurs."""
    if len(np.unique(cluster)) < ENOUGH_CLUSTERS:
        return False
    return all(len(np.unique(cluster[y == one])) >= ENOUGH_CLUSTERS for one in range(n_classes) if (y == one).any())


def plural(name: str) -> str:
    """Return the name of several units."""
    return name + ("es" if name.endswith("s") else "s")


def strata_of(y: npt.NDArray[Any], cluster: IntArray, n_classes: int) -> list[IntArray]:
    """Return the clusters that may stand in for each other: all, or class by class where each has one class only.

    Without it a resample could lose a class, and its score would be that of another question.
    """
    every = np.arange(int(cluster.max()) + 1)
    if n_classes == 0:
        return [every]
    there = np.zeros((len(every), n_classes), dtype=bool)
    there[cluster, y] = True
    if (there.sum(axis=1) > 1).any():
        return [every]
    own = there.argmax(axis=1)
    return [every[own == one] for one in np.unique(own)]


def loss_of(metric: Metric, y: npt.NDArray[Any], predicted: npt.NDArray[Any]) -> FloatArray:
    """Return (n,) what each row adds to the error: its square, or whether the class is wrong."""
    if metric.kind != "regression":
        return np.asarray(y != predicted, dtype=np.float64)
    squares = np.asarray((predicted - y) ** 2)
    return np.asarray(squares.sum(axis=1)) if metric.vector else squares


def circular_blocks(rows: FloatArray, length: int, rng: np.random.Generator) -> FloatArray:
    """Return (RESAMPLES, m) sums of `rows` resampled in circular blocks, each resample as long as the original."""
    n = len(rows)
    blocks = -(-n // length)
    last = n - (blocks - 1) * length
    out = np.zeros((RESAMPLES, rows.shape[1]))
    filled = np.flatnonzero(rows.any(axis=0))  # a recording of one class leaves most of the confusion matrix empty
    mine = rows[:, filled]
    total = np.concatenate([np.zeros((1, len(filled))), np.cumsum(np.concatenate([mine, mine[:length]]), axis=0)])
    starts = rng.integers(0, n, size=(RESAMPLES, blocks))
    whole = total[length : length + n] - total[:n]
    end = starts[:, -1]
    for place, column in enumerate(filled):
        sums = whole[:, place][starts[:, :-1]].sum(axis=1)
        out[:, column] = sums + total[end + last, place] - total[end, place]
    return out


def block_length(loss: FloatArray) -> int:
    """Return the block length for a circular bootstrap of the mean of `loss`, (n,) in time order.

    Notes
    -----
    ``b = (2 G² / D)^(1/3) n^(1/3)`` with ``D = 4/3 g(0)²``, the flat-top lag window, and the bandwidth from the last
    lag whose correlation is significant (Politis and White 2004, with the correction of 2009). Never shorter than
    ``n^(1/3)``: longer blocks than needed stay valid, and a loss that looks independent may only be rare.
    """
    n = len(loss)
    # The length knows no unit: scaled, so that the fourth power of an absurd error does not overflow.
    loss = loss / max(float(np.abs(loss).max()), np.finfo(np.float64).tiny)
    centred = loss - loss.mean()
    shortest = int(np.ceil(n ** (1 / 3)))
    if n < 8 or float(np.mean(centred**2)) <= 1e-30 * float(np.mean(loss**2)):
        return shortest
    _, g0, g = _lag_window(centred)
    if g0 == 0.0:
        return shortest
    length = (2.0 * (g / g0) ** 2 / (4.0 / 3.0)) ** (1 / 3) * n ** (1 / 3)
    return int(np.clip(np.ceil(length), shortest, max(shortest, min(np.ceil(3 * np.sqrt(n)), n // 3))))


def integrated_correlation(centred: FloatArray) -> float:
    """Return the sum of all correlations of (n,) numbers about their mean, at least that of white noise: 1.

    The mean of n of them varies by so many times ``variance / n``. By the window of :func:`block_length`.
    """
    if len(centred) < 8 or not (np.abs(centred) > 0).any():
        return 1.0
    variance, g0, _ = _lag_window(centred / np.abs(centred).max())
    return max(g0 / variance, 1.0)


def _lag_window(centred: FloatArray) -> tuple[float, float, float]:
    """Return variance, ``g(0) = sum c(k)`` and ``G = sum |k| c(k)`` of autocovariances c under the flat-top window."""
    n = len(centred)
    variance = float(np.mean(centred**2))
    reach = max(5, int(np.ceil(np.sqrt(np.log10(n)))))
    longest = int(np.ceil(np.sqrt(n))) + reach
    longest = min(longest, n - 1)
    covariance = _autocovariance(centred, 2 * longest)
    correlation = covariance[1 : longest + 1] / variance
    small = np.abs(correlation) < 2.0 * np.sqrt(np.log10(n) / n)
    last = longest
    for lag in range(len(small) - reach + 1):
        if small[lag : lag + reach].all():
            last = lag
            break
    bandwidth = min(2 * max(last, 1), len(covariance) - 1)
    lags = np.arange(-bandwidth, bandwidth + 1)
    ratio = np.abs(lags) / bandwidth
    window = np.where(ratio <= 0.5, 1.0, 2.0 * (1.0 - ratio))
    weighted = window * covariance[np.abs(lags)]
    return variance, float(weighted.sum()), float((np.abs(lags) * weighted).sum())


def _autocovariance(centred: FloatArray, lags: int) -> FloatArray:
    """Return the autocovariance at lags 0 … `lags`, by the fast Fourier transform with padding against wrap-around."""
    n = len(centred)
    size = 1 << int(np.ceil(np.log2(2 * n)))
    spectrum = np.fft.rfft(centred, size)
    return np.asarray(np.fft.irfft(np.abs(spectrum) ** 2, size)[: min(lags, n - 1) + 1] / n)
