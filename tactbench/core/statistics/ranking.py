"""Ranks that may be believed: ties share one, and each has an interval."""

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.interval import LEVEL
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.statistics.influence import Together, together

Row = Mapping[str, Any]
RESAMPLES = 2000
SEED = 0x7AC7
"""Of all resamples: the same rows have the same ranks, on any machine."""


@dataclass(frozen=True)
class Rank:
    """A place, and the places that the data do not exclude."""

    place: int
    low: int
    high: int
    tied: bool
    """another cell has the same place"""


def ranks(rows: Iterable[Row]) -> dict[str, Rank]:
    """Return the rank of each finished cell that is no baseline, by its name.

    Parameters
    ----------
    rows
        Rows of one block: of the same task, protocol, split, hardware and repeat.

    Notes
    -----
    A cell is *clearly better* than another if its score is, the interval of their paired difference does not contain 0,
    and does not lie within the task's region of practical equivalence. A place is 1 + the number of cells that are
    clearly better, and never better than that of a cell with a better score. So the best score always has place 1, a
    better score never a worse place, and what comes in far behind changes no place before it.

    Differences are paired over replicates where two cells have the same (:func:`together`), else their errors are taken
    as independent. Their interval is Student's, with the jackknife's standard error over replicates; of two degrees of
    freedom the smaller. A row without replicates enters with the interval that stands beside its score.

    `low` and `high` are the middle 95 % of the ranks in 2,000 resamples of the replicates, the same resamples for all
    cells with the same replicates; scores follow to first order, and deviate as far as Student's t says of so few
    replicates. They always reach to the cell's own place.

    The answer depends on `cell`, `score`, `ci_low`, `ci_high`, `metric`, `equivalence`, `classes` and `replicates` of
    these rows and on nothing else: it may be kept under a digest of them.
    """
    entered = [row for row in rows if row["status"] == "done" and not row["is_baseline"]]
    if not entered:
        return {}
    sign = -1.0 if METRICS[entered[0]["metric"]].higher_is_better else 1.0
    entered.sort(key=lambda row: (sign * row["score"], row["cell"]))
    names = [row["cell"] for row in entered]
    error = sign * np.array([row["score"] for row in entered], dtype=np.float64)  # the lower, the better
    groups = together(entered)
    deviation, freedom = _own_intervals(entered, groups)
    better = _clearly_better(error, deviation, freedom, groups, float(entered[0].get("equivalence") or 0.0))
    places = _places(better, error)
    low, high = _middle(error, deviation, freedom, groups)
    low, high = (
        np.minimum(_shared(low, error, np.minimum), places),
        np.maximum(_shared(high, error, np.maximum), places),
    )
    many = dict(zip(*np.unique(places, return_counts=True), strict=True))
    return {
        name: Rank(int(place), int(first), int(last), bool(many[place] > 1))
        for name, place, first, last in zip(names, places, low, high, strict=True)
    }


def _own_intervals(rows: Sequence[Row], groups: Sequence[Together]) -> tuple[FloatArray, FloatArray]:
    """Return (n,) standard errors and degrees of freedom: of the replicates, or else of the interval in the row."""
    normal = -float(importlib.import_module("scipy.special").ndtri((1 - LEVEL) / 2))
    deviation = np.full(len(rows), np.inf)
    freedom = np.full(len(rows), np.inf)
    covered = np.zeros(len(rows), dtype=bool)
    for group in groups:
        deviation[group.places] = np.sqrt(np.einsum("ij,ij->i", group.influence, group.influence))
        freedom[group.places] = group.freedom
        covered[group.places] = True
    for place in np.flatnonzero(~covered).tolist():
        low, high = rows[place]["ci_low"], rows[place]["ci_high"]
        if low is not None and high is not None:
            deviation[place] = (high - low) / (2 * normal)
    return deviation, freedom


def _clearly_better(
    error: FloatArray, deviation: FloatArray, freedom: FloatArray, groups: Sequence[Together], same: float
) -> IntArray:
    """Return (n,) how many cells are clearly better than each."""
    variance = np.add.outer(deviation**2, deviation**2)
    for group in groups:
        if len(group.places) == len(error) and (np.diff(group.places) == 1).all():
            variance -= 2 * (group.influence @ group.influence.T)
        else:
            variance[np.ix_(group.places, group.places)] -= 2 * (group.influence @ group.influence.T)
    np.maximum(variance, 0.0, out=variance)
    distinct, which = np.unique(freedom, return_inverse=True)
    quantile = importlib.import_module("scipy.special").stdtrit(np.minimum(distinct, 1e9), 0.5 + LEVEL / 2)
    if len(distinct) == 1:
        variance *= quantile[0] ** 2
    else:
        variance *= (quantile**2)[np.minimum.outer(which, which)]
    ahead = np.subtract.outer(error, error)  # of the line's cell over the column's: positive where the column is better
    clear = ahead > 0
    clear &= ahead**2 > variance
    if same > 0:
        clear &= ahead + np.sqrt(variance) > same
    return np.asarray(clear.sum(axis=1), dtype=np.int64)


def _places(better: IntArray, error: FloatArray) -> IntArray:
    """Return (n,) places of cells in order of their errors: equal scores have the same."""
    behind = 1 + np.maximum.accumulate(better)
    return np.asarray(behind[np.searchsorted(error, error, side="right") - 1])


def _shared(bound: IntArray, error: FloatArray, extreme: Any) -> IntArray:
    """Return `bound` with that of all cells of the same score for each."""
    first = np.searchsorted(error, error, side="left")
    starts = np.unique(first)
    return np.asarray(np.repeat(extreme.reduceat(bound, starts), np.diff([*starts, len(error)])), dtype=np.int64)


def _middle(
    error: FloatArray, deviation: FloatArray, freedom: FloatArray, groups: Sequence[Together]
) -> tuple[IntArray, IntArray]:
    """Return (n,) the lowest and the highest rank in the middle of the resamples."""
    special = importlib.import_module("scipy.special")
    n = len(error)
    tail = (1 - LEVEL) / 2
    widening = special.stdtrit(np.minimum(freedom, 1e9), tail) / special.ndtri(tail)
    drawn = np.zeros((RESAMPLES, n), dtype=np.float32)
    covered = np.zeros(n, dtype=bool)
    for group in groups:
        carried = (group.influence * widening[group.places, None]).T.astype(np.float32)
        sampled = _times(group) @ carried
        drawn[:, group.places] = sampled
        covered[group.places] = True
    for place in np.flatnonzero(~covered & np.isfinite(deviation)):
        drawn[:, place] = deviation[place] * _generator(str(place)).standard_normal(RESAMPLES)
    drawn += (error - np.median(error)).astype(np.float32)
    unknown = ~np.isfinite(deviation)
    drawn[::2, unknown], drawn[1::2, unknown] = np.inf, -np.inf  # these may be anywhere, before or behind the others
    order = np.argsort(drawn, axis=1)
    order *= n
    order += np.arange(n)
    counts = np.cumsum(np.bincount(order.ravel(), minlength=n * n).reshape(n, n), axis=1)
    low = 1 + (counts <= tail * RESAMPLES).sum(axis=1)
    high = 1 + (counts < (1 - tail) * RESAMPLES).sum(axis=1)
    low[unknown], high[unknown] = 1, n
    return low, high


def _times(group: Together) -> npt.NDArray[np.float32]:
    """Return (RESAMPLES, replicates) how much oftener than once each replicate is drawn, within its stratum."""
    rng = _generator("\n".join(group.names))
    times = np.zeros((RESAMPLES, len(group.names)), dtype=np.float32)
    for one in np.unique(group.strata):
        mine = np.flatnonzero(group.strata == one)
        times[:, mine] = rng.multinomial(len(mine), np.full(len(mine), 1 / len(mine)), size=RESAMPLES) - 1
    return times


def _generator(names: str) -> np.random.Generator:
    """Return the generator of these replicates: the same for all cells that have them, another for all others."""
    digest = hashlib.blake2b(names.encode(), digest_size=8).digest()
    return np.random.default_rng([SEED, int.from_bytes(digest, "little")])
