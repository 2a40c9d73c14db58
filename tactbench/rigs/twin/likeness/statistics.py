"""What is computed from readings: pure functions of arrays. Rows are samples or states, columns channels."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray


def white_noise(counts: FloatArray) -> FloatArray:
    """Return (channels,) the standard deviation of white noise in (n, channels) samples, n >= 3.

    Root mean square of second differences over sqrt 6: a level and a straight drift drop out exactly, and white noise
    of standard deviation s has second differences of variance (1 + 4 + 1) s².
    """
    return np.asarray(np.sqrt(np.mean(np.diff(counts, 2, axis=0) ** 2, axis=0) / 6.0))


def noise_correlation(counts: FloatArray) -> float:
    """Return the median correlation of the second differences of two channels, over all pairs.

    Channels that never move are left out; not a number when fewer than two remain.
    """
    second = np.diff(counts, 2, axis=0)
    second = second[:, second.std(axis=0) > 0]
    if second.shape[1] < 2:
        return float("nan")
    among = np.asarray(np.corrcoef(second, rowvar=False))
    return float(np.median(among[np.triu_indices(second.shape[1], 1)]))


def allan_deviation(counts: FloatArray, dt_s: float, tau_s: float) -> FloatArray:
    """Return (channels,) ``sqrt(<(mean_{k+1} - mean_k)²> / 2)`` over neighbouring averages of `tau_s`.

    Averages do not overlap. White noise falls as 1/sqrt(tau); a ramp of slope c gives c tau / sqrt 2 (Allan 1966).
    Not a number with fewer than two averages.
    """
    rows = max(1, round(tau_s / dt_s))
    whole = counts.shape[0] // rows
    if whole < 2:
        return np.full(counts.shape[1], np.nan)
    means = counts[: whole * rows].reshape(whole, rows, -1).mean(axis=1)
    return np.asarray(np.sqrt(np.mean(np.diff(means, axis=0) ** 2, axis=0) / 2.0))


def component_shares(change: FloatArray) -> FloatArray:
    """Return the shares of variance of the principal components of (n, channels), descending, sum 1."""
    singular = np.linalg.svd(change - change.mean(axis=0), compute_uv=False)
    return np.asarray(singular**2 / np.sum(singular**2))


def participation(change: FloatArray, least: float = 0.0) -> FloatArray:
    """Return (n,) how many channels take part, ``(sum |c|)² / sum c²``: n for n equal changes, 1 for a single one.

    Changes below `least` count as none. Not a number where nothing is left.
    """
    size = np.where(np.abs(change) >= least, np.abs(change), 0.0)
    squares = np.sum(size**2, axis=1)
    return np.asarray(np.sum(size, axis=1) ** 2 / np.where(squares > 0, squares, np.nan))


def warming(t_s: FloatArray, level: FloatArray) -> tuple[float, float]:
    """Return (rise still to come at the first sample, time constant [s]) of ``level = a - w exp(-t / tau)``.

    Least squares: for each time constant the other two are linear; the best one by golden section between a twentieth
    and five times the length of the record, beyond which a record cannot tell.
    """
    t = t_s - t_s[0]

    def fit(tau: float) -> tuple[float, float]:
        basis = np.stack([np.ones_like(t), -np.exp(-t / tau)], axis=1)
        found, *_ = np.linalg.lstsq(basis, level, rcond=None)
        return float(np.sum((basis @ found - level) ** 2)), float(found[1])

    low, high = np.log(t[-1] / 20.0), np.log(5.0 * t[-1])
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    for _ in range(60):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if fit(float(np.exp(left)))[0] < fit(float(np.exp(right)))[0]:
            high = right
        else:
            low = left
    tau = float(np.exp((low + high) / 2.0))
    return fit(tau)[1], tau


def offsets(levels: FloatArray) -> tuple[float, float]:
    """Return (shared, own) standard deviation of (recordings, channels) rest levels from recording to recording.

    Shared: of the mean over channels. Own: median over channels, of what is left.
    """
    shared = levels.mean(axis=1)
    own = levels - levels.mean(axis=0) - (shared - shared.mean())[:, None]
    n = levels.shape[1]
    # Taking the mean over n channels away removes one nth of each channel's own variance.
    return float(shared.std(ddof=1)), float(np.median(own.std(axis=0, ddof=1)) * np.sqrt(n / max(n - 1, 1)))


def zero_crossing(angle_deg: FloatArray, change: FloatArray, edges_deg: Sequence[float]) -> float:
    """Return the angle at which the mean change, averaged in bins of angle, first turns from falling to rising.

    Straight between the middles of bins; not a number if it never does. Empty bins are passed over.
    """
    previous: tuple[float, float] | None = None
    for low, high in itertools.pairwise(edges_deg):
        inside = (angle_deg >= low) & (angle_deg < high)
        if not inside.any():
            continue
        here = ((low + high) / 2.0, float(change[inside].mean()))
        if previous is not None and previous[1] < 0 <= here[1]:
            return float(previous[0] - previous[1] * (here[0] - previous[0]) / (here[1] - previous[1]))
        previous = here
    return float("nan")
