"""Estimation of the lag of a sensor's time stamps behind those of the reference that measures the same force.

Creep, relaxation and hysteresis also make loops in a plot of taxel over force, and a time shift removes part of them.
But such a sensor answers each change at once, and adds a weighted past of the force or a term of its direction. So the
taxels are fitted twice: by a curve over the shifted force, and by this curve with the past and the direction of the
shifted force. A lag is reported only if both fits need it.
"""

from __future__ import annotations

from dataclasses import dataclass

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
FASTEST_DRIFT = 0.05
"""Largest rate at which two clocks drift apart [1]."""
SIGNIFICANT = 4.0
"""Number of standard errors above which a lag is significant."""
LONGEST_S, MOST_ROWS = 60.0, 2000
"""Longest recording, in seconds or in rows of the slower stream, that is examined whole; of longer recordings, two ends
of half this length are."""
_BLOCKS = 8
_ITERATIONS = 6


@dataclass(frozen=True)
class Lag:
    """Lag of a sensor [s] and its standard error at three places; negative where the sensor is early."""

    beginning: tuple[float, float]
    middle: tuple[float, float]
    end: tuple[float, float]
    drifts: bool
    """True if the lag changes by more than a sample and four standard errors."""


def windows(sensor_ns: IntArray, force_ns: IntArray) -> dict[str, tuple[int, int]]:
    """Return the spans [ns] to search for a lag, by place, within the time that both streams cover."""
    first, last = int(max(sensor_ns[0], force_ns[0])), int(min(sensor_ns[-1], force_ns[-1]))
    slower = max(float(times[-1] - times[0]) / (len(times) - 1) for times in (sensor_ns, force_ns))
    longest = int(max(1e9 * LONGEST_S, MOST_ROWS * slower))
    if last - first <= longest:
        return {"": (first, last)}
    return {" at the beginning": (first, first + longest // 2), " at the end": (last - longest // 2, last)}


def find_lag(sensor_ns: IntArray, sensor: FloatArray, force_ns: IntArray, force: FloatArray) -> Lag | None:
    """Return the lag of a sensor's leading component behind that of a reference.

    `sensor_ns` (n,) and `force_ns` (m,) are increasing times [ns], meant to be of the same clock; `sensor` (n, p) and
    `force` (m, q) are finite samples. None: no lag exceeds one sample and four standard errors, or the force, such
    as a slow ramp or a sine without rests, allows no estimate.

    Separable least squares (Golub and Pereyra 1973) in the lag and its linear change, by Gauss-Newton steps from where
    the cross-correlation is best. The error combines the jackknife over eight stretches of time and the difference
    between the two fits.
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
    best: tuple[float, FloatArray, FloatArray] | None = None
    curve = past = np.empty((0, 0))
    for start in _starts(x, f):
        lag, drift = start
        reach = int(0.35 * abs(lag) + abs(drift)) + 3
        if abs(lag) + reach > len(x) / 3:
            continue
        if not len(past):
            curve = _curve(f)
            past = np.hstack([curve, _past(f, step)])
        shifts = min(0, int(lag) - reach), max(0, int(lag) + reach)
        other, _, plain_left, plain_unshifted = _nearest(x, curve, shifts, np.array(start))
        found, error, left, unshifted = _nearest(x, past, shifts, other)
        noise = 2 * _squares(left) / np.sqrt(len(left))  # of an autocovariance, two standard errors
        needed = _neighbours(unshifted) > NEEDED * (max(_neighbours(left), 0.0) + noise)
        suspected = _squares(plain_unshifted) > SUSPECTED * _squares(plain_left)
        if needed and suspected and 2 * abs(found[1]) < FASTEST_DRIFT * len(x):
            share = _squares(left) / len(left)
            if best is None or share < best[0]:
                best = share, found, error + np.outer(found - other, found - other) / 2 + np.diag([1 / 48, 0])
    if best is None:
        return None
    _, found, error = best

    def at(*weights: float) -> tuple[float, float]:
        return step * float(found @ weights), step * float(np.sqrt(weights @ error @ weights))

    def significant(lag: float, error: float) -> bool:
        return abs(lag) > max(slower, SIGNIFICANT * error)

    late = Lag(at(1, -1), at(1, 0), at(1, 1), drifts=significant(*at(0, 2)))
    places = (late.beginning, late.end) if late.drifts else (late.middle,)
    return late if any(significant(*place) for place in places) else None


def _nearest(
    x: FloatArray, columns: FloatArray, shifts: tuple[int, int], start: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Fit columns to `x` shifted by a lag, over the rows that exist for every lag in the range `shifts`.

    Return the best lag in the middle and its change from there to the end [rows] near `start`, (2,), their covariance,
    (2, 2), the residual, and the residual without a lag.
    """
    every = np.arange(len(x))
    rows = np.arange(-shifts[0], len(x) - shifts[1])
    place, slope = 2 * rows / len(x) - 1, np.gradient(x)
    base = np.linalg.qr(columns[rows])[0]

    def unexplained(values: FloatArray) -> FloatArray:
        return values - base @ (base.T @ values)

    def shifted(values: FloatArray, at: FloatArray) -> FloatArray:
        return np.asarray(np.interp(rows + at[0] + at[1] * place, every, values))

    at, before, best = start, np.zeros(2), np.inf
    left = slopes = np.empty((0, 2))
    for _ in range(_ITERATIONS):
        new = unexplained(shifted(x, at))
        if _squares(new) >= best:
            at = (at + before) / 2
            continue
        best, before, left = _squares(new), at, new
        steeper = shifted(slope, at)
        slopes = np.column_stack([unexplained(steeper), unexplained(steeper * place)])
        at = at - np.linalg.lstsq(slopes, left, rcond=None)[0]
    block = np.arange(len(left)) * _BLOCKS // len(left)
    moved = np.array([np.linalg.lstsq(slopes[block != b], left[block != b], rcond=None)[0] for b in range(_BLOCKS)])
    return before, (_BLOCKS - 1) * np.cov(moved.T, bias=True), left, unexplained(shifted(x, np.zeros(2)))


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


def _starts(x: FloatArray, f: FloatArray) -> list[tuple[float, float]]:
    """Return the lags and drifts [rows] at which the search starts, from the whole recording and from both halves."""
    lag, gain = _correlated(x, f, len(x) // 5)
    starts = [(float(lag), 0.0)] if gain > SUSPECTED else []
    if starts or len(x) > 10 * FEWEST_ROWS:
        half = len(x) // 2
        parts = [_correlated(_standard(x[rows]), _standard(f[rows]), half // 8)
                 for rows in (slice(half), slice(half, None))]  # fmt: skip
        if any(gain > SUSPECTED for _, gain in parts):
            first, second = (lag for lag, _ in parts)
            starts.append(((first + second) / 2, float(second - first)))
    return starts


def _correlated(x: FloatArray, f: FloatArray, most: int) -> tuple[int, float]:
    """Return the shortest of the best lags up to `most` rows, and the factor by which it reduces squared residuals.

    If the force repeats itself, several lags are equally good. The factor is 0 if the search ends at `most` rows.
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
    inside = 0 < place < 2 * most
    return int(lags[place]), inside * float(left[most] / max(left[place], 1e-12))


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
