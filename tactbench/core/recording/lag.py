"""Estimation of the lag of a sensor's time stamps behind those of the reference that measures the same force.

Creep, relaxation and hysteresis also make loops in a plot of taxel over force, and a time shift removes part of them.
But such a sensor answers each change at once, and adds a weighted past of the force or a term of its direction. So the
taxels are fitted twice: by a curve over the shifted force, and by this curve with the past and the direction of the
shifted force. A lag is reported only if both fits need it.
"""

from __future__ import annotations

import numpy as np

from tactbench.core.samples import FloatArray, IntArray

FINEST_S = 0.01
"""Smallest step of the common time grid [s]; a longer median step of the slower stream is taken instead."""
FEWEST_ROWS = 100
"""Fewest rows of a stream, and of the common grid, for which a lag is estimated."""
TIME_CONSTANTS_S = (0.05, 0.2, 0.8, 3.2)
"""Time constants of the low-passes in the second fit [s]; sums of two approximate those between to a few percent."""
DEGREE = 5
"""Degree of the polynomial curve, which must follow the kinks of a sensor with saturation or a threshold."""
SUSPECTED = 1.3
"""Factor by which a lag must reduce the sum of squared residuals of the first fit."""
NEEDED = 4.0
"""Factor by which a lag must reduce the autocovariance, at one row, of the second fit's residuals, in which white noise
does not count. Of 5,376 simulated sensors without a lag, most with creep, relaxation or hysteresis, two exceeded it,
both under a sine without rests; a lag of 100 ms gives 5 to 1,000."""
SIGNIFICANT = 4.0
"""Number of standard errors above which a lag is significant."""
LONGEST_S, MOST_ROWS = 60.0, 2000
"""Longest recording, in seconds or in rows of the slower stream, that is examined whole; of longer recordings, two ends
of half this length are."""
_BLOCKS = 8
_ITERATIONS = 6


def windows(sensor_ns: IntArray, force_ns: IntArray) -> list[dict[str, tuple[int, int]]]:
    """Return the spans [ns] to search for a lag, by place: the whole recording, and if it shows no lag, both ends."""
    first, last = int(max(sensor_ns[0], force_ns[0])), int(min(sensor_ns[-1], force_ns[-1]))
    slower = max(float(times[-1] - times[0]) / (len(times) - 1) for times in (sensor_ns, force_ns))
    longest = int(max(1e9 * LONGEST_S, MOST_ROWS * slower))
    half = min(longest, last - first) // 2
    ends = {" at the beginning": (first, first + half), " at the end": (last - half, last)}
    return [ends] if last - first > longest else [{"": (first, last)}, ends]


def find_lag(
    sensor_ns: IntArray, sensor: FloatArray, force_ns: IntArray, force: FloatArray
) -> tuple[float, float] | None:
    """Return the lag [s] of a sensor's leading component behind a reference's, and the lag's standard error [s].

    Parameters
    ----------
    sensor_ns, force_ns
        (n,) and (m,) increasing times [ns], meant to be of the same clock.
    sensor, force
        (n, p) and (m, q) samples, all finite.

    Returns
    -------
    tuple of float or None
        Negative if the sensor is early. None: no lag is above a sample and four standard errors, or the force allows no
        estimate: a slow ramp, a sine without rests.

    Notes
    -----
    Separable least squares (Golub and Pereyra 1973) in the lag, by Gauss-Newton steps from the lag of best correlation.
    The error combines the jackknife over eight stretches of time and the difference between the two fits.
    """
    if min(len(sensor), len(force)) < FEWEST_ROWS or not sensor.shape[1] or not force.shape[1]:
        return None
    sensor_s, force_s = (1e-9 * (times - sensor_ns[0]) for times in (sensor_ns, force_ns))
    slower = max(float(np.median(np.diff(times))) for times in (sensor_s, force_s))
    step = max(slower, FINEST_S)
    edges = np.arange(max(sensor_s[0], force_s[0]), min(sensor_s[-1], force_s[-1]), step)
    if len(edges) < FEWEST_ROWS:
        return None
    x, f = _leading(sensor_s, sensor, edges), _leading(force_s, force, edges)
    lag, gain = _correlated(x, f, len(x) // 5)
    reach = int(0.35 * abs(lag)) + 3
    if gain <= SUSPECTED or abs(lag) + reach > len(x) / 3:
        return None
    curve, shifts = _curve(f), (min(0, lag - reach), max(0, lag + reach))
    full, plain = _Explained(x, np.hstack([curve, _past(f, step)]), *shifts), _Explained(x, curve, *shifts)
    other, plain_left, _ = plain.nearest(lag)
    found, left, variance = full.nearest(other)
    noise = 2 * _squares(left) / np.sqrt(len(left))  # of an autocovariance, two standard errors
    needed = _neighbours(full.residual(0.0)) > NEEDED * (max(_neighbours(left), 0.0) + noise)
    suspected = _squares(plain.residual(0.0)) > SUSPECTED * _squares(plain_left)
    seconds, error = step * found, step * float(np.sqrt(variance + (found - other) ** 2 / 2 + 1 / 48))
    return (seconds, error) if needed and suspected and abs(seconds) > max(slower, SIGNIFICANT * error) else None


class _Explained:
    """Least-squares fit of columns to `x` shifted by a lag, over the rows that exist for every lag in a range."""

    def __init__(self, x: FloatArray, columns: FloatArray, lowest: int, highest: int) -> None:
        self._rows = np.arange(-lowest, len(x) - highest)
        self._x, self._slope = x, np.gradient(x)
        self._base = np.linalg.qr(columns[self._rows])[0]

    def residual(self, lag: float, *, slope: bool = False) -> FloatArray:
        """Return the fit's residual, (rows,), of `x` or of its slope taken `lag` rows later."""
        values = np.interp(self._rows + lag, np.arange(len(self._x)), self._slope if slope else self._x)
        return np.asarray(values - self._base @ (self._base.T @ values))

    def nearest(self, lag: float) -> tuple[float, FloatArray, float]:
        """Return the best lag [rows] near `lag`, its residual, and its variance [rows²]."""
        at, before, best, left = float(lag), 0.0, np.inf, self.residual(lag)
        slope = left
        for _ in range(_ITERATIONS):
            new = self.residual(at)
            if _squares(new) >= best:
                at = (at + before) / 2
                continue
            best, before, left, slope = _squares(new), at, new, self.residual(at, slope=True)
            at -= float(slope @ left) / max(_squares(slope), 1e-300)
        block = np.arange(len(left)) * _BLOCKS // len(left)
        moved = [
            slope[block != b] @ left[block != b] / max(_squares(slope[block != b]), 1e-300) for b in range(_BLOCKS)
        ]
        return before, left, (_BLOCKS - 1) * float(np.var(moved))


def _squares(left: FloatArray) -> float:
    return float(left @ left)


def _neighbours(left: FloatArray) -> float:
    return float(left[1:] @ left[:-1])


def _leading(times: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Return the leading principal component, averaged between grid `edges`, with mean 0 and variance 1."""
    centred = values - values.mean(axis=0)
    component = centred @ np.linalg.eigh(centred.T @ centred)[1][:, -1]
    area = np.concatenate([[0.0], np.cumsum((component[1:] + component[:-1]) / 2 * np.diff(times))])
    return _standard(np.diff(np.interp(edges, times, area)))


def _standard(values: FloatArray) -> FloatArray:
    values = values - values.mean()
    spread = float(values.std())
    return values / spread if spread > 0 else values


def _correlated(x: FloatArray, f: FloatArray, most: int) -> tuple[int, float]:
    """Return the shortest of the best lags up to `most` rows, and the factor by which it reduces squared residuals.

    If the force repeats itself, several lags are equally good.
    """
    curve = _curve(f)[:, 2:]
    base = np.linalg.qr(curve - curve.mean(axis=0))[0]
    length = 2 * len(x)
    spectra = np.conj(np.fft.rfft(base, length, axis=0)) * np.fft.rfft(x, length)[:, None]
    lags = np.arange(-most, most + 1)
    explained = (np.fft.irfft(spectra, length, axis=0)[lags] ** 2).sum(axis=1) * len(x) / (len(x) - abs(lags))
    left = 1 - np.minimum(explained / max(_squares(x), 1e-300), 1)
    good = np.flatnonzero(left <= 1.25 * left.min() + 1e-4)
    place = int(good[np.argmin(abs(lags[good]))])
    while 0 < place < 2 * most and min(left[place - 1], left[place + 1]) < left[place]:
        place += -1 if left[place - 1] < left[place + 1] else 1
    if place in (0, most, 2 * most):
        return 0, 0.0
    return int(lags[place]), float(left[most] / max(left[place], 1e-12))


def _curve(f: FloatArray) -> FloatArray:
    """Return columns (n, …): a constant, a trend in time, and polynomials of the force.

    Polynomials of a shifted ramp are polynomials of the ramp, so that a ramp shows no lag, whatever the curve is.
    """
    scaled = 2 * (f - f.min()) / max(float(np.ptp(f)), 1e-300) - 1
    polynomials = np.polynomial.chebyshev.chebvander(scaled, DEGREE)
    return np.column_stack([np.ones_like(f), np.linspace(-1, 1, len(f)), polynomials[:, 1:]])


def _past(f: FloatArray, step: float) -> FloatArray:
    """Return columns (n, …): the low-passed force, decays of forces before the first row, and the force's direction."""
    n, times = len(f), np.arange(len(f)) * step
    spectrum = np.fft.rfft(f - f[0], 2 * n)
    columns = []
    for constant in TIME_CONSTANTS_S:
        if constant > step:
            decay = np.exp(-times / constant)
            columns += [decay, np.fft.irfft(spectrum * np.fft.rfft(decay, 2 * n), 2 * n)[:n] * step / constant]
    rate = np.convolve(np.gradient(f), np.ones(3) / 3, "same")
    direction = np.tanh(3 * rate / max(float(rate.std()), 1e-300))
    return np.column_stack([*columns, direction, direction * f])
