"""Blocks of time: how long the memory of a series is, and its resampling in blocks of that length.

References
----------
.. [1] Politis and Romano 1992, A circular block-resampling procedure for stationary data.
.. [2] Politis and White 2004, Automatic block-length selection for the dependent bootstrap.
.. [3] Patton, Politis and White 2009, correction to [2]_.
"""

from __future__ import annotations

import numpy as np

from tactbench.core.samples import FloatArray

RESAMPLES = 2000


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
    longest = min(int(np.ceil(np.sqrt(n))) + reach, n - 1)
    spectrum = np.fft.rfft(centred, 1 << int(np.ceil(np.log2(2 * n))))  # padded: circular sums would wrap around
    covariance = np.fft.irfft(np.abs(spectrum) ** 2)[: min(2 * longest, n - 1) + 1] / n
    correlation = covariance[1 : longest + 1] / variance
    small = np.abs(correlation) < 2.0 * np.sqrt(np.log10(n) / n)
    last = next((lag for lag in range(len(small) - reach + 1) if small[lag : lag + reach].all()), longest)
    bandwidth = min(2 * max(last, 1), len(covariance) - 1)
    lags = np.arange(-bandwidth, bandwidth + 1)
    ratio = np.abs(lags) / bandwidth
    window = np.where(ratio <= 0.5, 1.0, 2.0 * (1.0 - ratio))
    weighted = window * covariance[np.abs(lags)]
    return variance, float(weighted.sum()), float((np.abs(lags) * weighted).sum())
