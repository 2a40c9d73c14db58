"""Noise floor of the reference sensor, errors beyond that floor, and the true force of a simulated rig.

The noise of the reference, of standard deviation f, adds to every RMSE against it: for an estimator with an own error
of e, the RMSE is ``sqrt(e² + f²)``. The floor f is measured in the recording's unloaded hold, where the true force
does not change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset, Table
from tactbench.core.evaluation.interval import Interval, ReplicateUnits, influences, student_quantile
from tactbench.core.evaluation.metrics import EXCESS, Metric, ratio
from tactbench.core.evaluation.sets import unloaded
from tactbench.core.samples import Answers, FloatArray, IntArray
from tactbench.core.spec.task import ChannelTarget, TaskSpec

FEWEST = 30
"""Least number of independent unloaded samples for a floor (assumed): 30 give a standard deviation to 13 %."""


@dataclass(frozen=True)
class Floor:
    """Noise floor of the reference, from its unloaded readings in the test recordings."""

    holds: dict[int, FloatArray]
    """(n, 2) squares and degrees of freedom (:func:`hold_of`) by index of the recording."""

    @property
    def value(self) -> float:
        """Standard deviation of the unloaded reference, pooled over recordings, in the target's unit."""
        return float(np.sqrt(self.square))

    @property
    def square(self) -> float:
        """Variance of the unloaded reference, pooled over recordings."""
        return float(ratio(sum(one.sum(axis=0) for one in self.holds.values())))

    @property
    def standard_error(self) -> float:
        """Standard error of :attr:`value`, from that of a mean of correlated squares by the derivative of the root."""
        squares = [one[:, 0] - one[:, 0].mean() for one in self.holds.values()]
        variance = sum(integrated_correlation(one) * (one @ one) for one in squares)
        return float(np.sqrt(variance) / sum(map(len, squares)) / (2.0 * self.value)) if variance else 0.0

    def by_replicate(self, tested: Answers, code: IntArray) -> FloatArray:
        """Return (replicates, 2) sums of squares and degrees of freedom; `code` is the (n,) replicate of each test row.

        If a recording's test rows are in several replicates, the samples of its hold are divided among these in order
        of time and in proportion to the numbers of their rows.
        """
        out = np.zeros((int(code.max()) + 1, 2))
        for place, hold in self.holds.items():
            mine = np.flatnonzero(tested.recording == place)
            codes = code[mine[np.argsort(tested.row[mine], kind="stable")]]
            np.add.at(out, codes[np.arange(len(hold)) * len(codes) // len(hold)], hold)
        return out


def reference_floor(task: TaskSpec, metric: Metric, data: Dataset, tested: Answers) -> tuple[Floor | None, str]:
    """Return the noise floor from the unloaded holds of the test recordings, or None and the reason.

    Notes
    -----
    Sums of squares about each hold's own mean, and their degrees of freedom, are pooled, so that offsets between
    recordings do not count as noise and the variance is unbiased. The mean of n samples whose correlations sum to tau
    (1 for white noise) uses ``tau`` degrees of freedom, not one: ``E sum (y - mean)² = n sigma² - n var(mean) =
    (n - tau) sigma²``, so that the floor of a low-pass filtered reference is correct too.
    """
    target = task.target
    if metric.name != "rmse" or not isinstance(target, ChannelTarget) or target.kind != "force":
        return None, ""
    holds: dict[int, FloatArray] = {}
    for place in np.unique(tested.recording).tolist():
        table = data.tables[place]
        why = _no_hold(table)
        if why:
            return None, f"no floor of the reference: recording {table.meta.name!r} {why}"
        holds[place] = hold_of(table.y[unloaded(table) & table.labelled])
    if sum(one[:, 1].sum() for one in holds.values()) < FEWEST:
        return None, f"no floor of the reference: fewer than {FEWEST} independent samples of it are unloaded"
    return Floor(holds), ""


def _no_hold(table: Table) -> str:
    if table.meta.scene is not None and table.meta.scene.drive is not None:
        return "was pressed by a force loop, whose motion during the hold is no noise of the reference"
    if (unloaded(table) & table.labelled).sum() < 2:
        return "states no unloaded hold, or has fewer than two samples of the reference in it"
    return ""


def hold_of(y: npt.NDArray[Any]) -> FloatArray:
    """Return (n, 2) squares and degrees of freedom of n >= 2 samples of the unloaded reference, in order of time.

    Columns: a sample's squared difference from the mean, and its part of the degrees of freedom. All parts sum to
    n - 1 for white noise, and to less for correlated noise.
    """
    centred = y - np.mean(y)
    n = len(centred)
    freedom = n - min(integrated_correlation(centred), n / 2)
    return np.column_stack([centred**2, np.full(n, freedom / n)])


def beyond_floor(floor: Floor, tested: Answers, unit: ReplicateUnits) -> tuple[float, Interval]:
    """Return the part of a RMSE beyond the noise floor, and its 95 % interval (without ends for too few units).

    Notes
    -----
    The interval is computed for ``mean (p - y)² - floor²``, which may be below zero and is a sum of two independent
    means; its ends are then transformed by ``sqrt(max(0, .))``. Each unit is left out in turn (jackknife), with its
    part of the holds.
    """
    loss = (tested.y_pred - tested.y_true) ** 2
    excess = float(loss.mean() - floor.square)
    if not unit.enough(tested.y_true, 0):
        return _root(excess), Interval()
    held = floor.by_replicate(tested, unit.codes)
    sums = np.column_stack([unit.sums(np.column_stack([loss, np.ones(len(loss))])), held])
    without = EXCESS.score(sums.sum(axis=0) - sums, 0)
    carried = influences(without, np.zeros(len(sums), dtype=np.int64))
    reach = float(student_quantile(len(sums) - 1)) * float(np.sqrt(carried @ carried))
    return _root(excess), Interval(_root(excess - reach), _root(excess + reach))


def _root(excess: float) -> float:
    return float(np.sqrt(max(0.0, excess)))


def true_force(task: TaskSpec, data: Dataset, tested: Answers) -> FloatArray | None:
    """Return the (n,) forces [N] that the rig exerted at the test rows; None if they are unknown.

    A simulated rig without a force loop follows its scene's profile exactly, so the profile is the true force, without
    noise and filters of the reference. The true force of a real rig, or of a simulated one with a force loop, is not
    recorded.
    """
    target = task.target
    if not isinstance(target, ChannelTarget) or (target.kind, target.unit) != ("force", "N"):
        return None
    if target.name not in (None, "normal"):
        return None
    out = np.zeros(len(tested))
    for place in np.unique(tested.recording).tolist():
        mine, meta = tested.recording == place, data.tables[place].meta
        if meta.scene is None or not meta.simulated or meta.clock == "none" or meta.scene.drive is not None:
            return None
        out[mine] = np.interp(tested.time_s[mine], *meta.scene.profile.corners)
    return out


def integrated_correlation(centred: FloatArray) -> float:
    """Return the sum of the autocorrelations of (n,) centred numbers over all lags; at least 1, as for white noise.

    It is the factor by which the variance of their mean exceeds ``variance / n``, estimated by the flat-top lag window,
    whose bandwidth is twice the last lag with a significant correlation (Politis and White 2004, Automatic block-length
    selection for the dependent bootstrap).
    """
    n = len(centred)
    if n < 8 or not (np.abs(centred) > 0).any():
        return 1.0
    centred = centred / np.abs(centred).max()
    reach = max(5, int(np.ceil(np.sqrt(np.log10(n)))))
    longest = min(int(np.ceil(np.sqrt(n))) + reach, n - 1)
    spectrum = np.fft.rfft(centred, 1 << int(np.ceil(np.log2(2 * n))))  # padded: circular sums would wrap around
    covariance = np.fft.irfft(np.abs(spectrum) ** 2)[: min(2 * longest, n - 1) + 1] / n
    variance = float(np.mean(centred**2))
    small = np.abs(covariance[1 : longest + 1] / variance) < 2.0 * np.sqrt(np.log10(n) / n)
    last = next((lag for lag in range(len(small) - reach + 1) if small[lag : lag + reach].all()), longest)
    bandwidth = min(2 * max(last, 1), len(covariance) - 1)
    lags = np.arange(-bandwidth, bandwidth + 1)
    ratio = np.abs(lags) / bandwidth
    window = np.where(ratio <= 0.5, 1.0, 2.0 * (1.0 - ratio))
    return max(float((window * covariance[np.abs(lags)]).sum()) / variance, 1.0)
