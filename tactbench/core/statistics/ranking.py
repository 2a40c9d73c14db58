"""Ranks that may be believed: ties share one, and each has an interval."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.core.evaluation.metrics import EXCESS, SUMMED
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.statistics.influence import Together, together
from tactbench.core.statistics.student import NORMAL, quantile

Row = Mapping[str, Any]
_STRIP = 64
"""Cells compared with all others at once: what a processor keeps at hand."""


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
    A cell is *clearly better* than another if its score is, and the interval of their paired difference neither
    contains 0 nor lies within the task's region of practical equivalence. A place is 1 + the number of cells that are
    clearly better, and never better than that of a cell with a better score. So the best score always has place 1, a
    better score never has a worse place, and what comes in far behind changes no place before it.

    `low` and `high` are the ranks that no comparison of two excludes: 1 + the number of cells that are clearly better,
    and the number of cells that are not clearly worse, itself among them [1]_. Resampling the ranks themselves says too
    little where cells are close: among near ties it covers as little as 77 % where 95 % are promised [2]_; see
    ``benchmarks/coverage.py``.

    Errors of force are ranked by what is beyond the floor of their reference, if all of them have one: by
    ``score² - floor²``, whose sums over replicates are exact and whose differences are free of what two cells' floors
    share. The region of practical equivalence is that of the roots: ``b² … (b + region)²`` for the better one's b.

    Differences are paired over replicates where two cells have the same (:func:`together`), else their errors are taken
    as independent. Their interval is Student's, with the jackknife's standard error over replicates; of two degrees of
    freedom the smaller. A row without replicates enters with the interval that stands beside its score.

    Nothing is drawn at random, and the answer depends on `cell`, `score`, `ci_low`, `ci_high`, `metric`, `classes`,
    `equivalence`, `replicates` and the three keys of the error beyond the floor of these rows and on nothing else: it
    may be kept under a digest of them.

    References
    ----------
    .. [1] Mogstad, Romano, Shaikh and Wilhelm 2024, Inference for ranks, Review of Economic Studies 91; here at the
       level of a single pair, not of all pairs at once.
    .. [2] Hall and Miller 2009, Using the bootstrap to quantify the authority of an empirical ranking.
    """
    entered = [row for row in rows if row["status"] == "done" and not row["is_baseline"]]
    if not entered:
        return {}
    if beyond_floor(entered):
        entered = [_excess(row) for row in entered]
    sign = -1.0 if SUMMED[entered[0]["metric"]].higher_is_better else 1.0
    entered.sort(key=lambda row: (sign * row["score"], row["cell"]))
    error = sign * np.array([row["score"] for row in entered], dtype=np.float64)  # the lower, the better
    better, worse = _clearly(entered, error)
    low = 1 + better
    places = _places(low, error)
    high = np.maximum(len(entered) - worse, places)
    many = np.bincount(places)
    return {
        row["cell"]: Rank(place, first, last, bool(many[place] > 1))
        for row, place, first, last in zip(entered, places.tolist(), low.tolist(), high.tolist(), strict=True)
    }


def beyond_floor(rows: Sequence[Row]) -> bool:
    """Return whether rows are ranked by their errors beyond the floor: all have one."""
    return all(row["metric"] == "rmse" and row.get("reference_floor") is not None for row in rows)


def _excess(row: Row) -> Row:
    """Return a row of a RMSE as that of its mean square beyond the floor, which may be below zero."""
    ends = {"ci_low": row["beyond_floor_ci_low"], "ci_high": row["beyond_floor_ci_high"]}
    squares = {key: None if value is None else value * value for key, value in ends.items()}
    excess = row["score"] * row["score"] - row["reference_floor"] * row["reference_floor"]
    return {**row, **squares, "score": excess, "metric": EXCESS.name}


def _places(low: IntArray, error: FloatArray) -> IntArray:
    """Return (n,) places of cells in order of their errors: equal scores have the same."""
    behind = np.maximum.accumulate(low)
    return np.asarray(behind[np.searchsorted(error, error, side="right") - 1])


def _clearly(rows: Sequence[Row], error: FloatArray) -> tuple[IntArray, IntArray]:
    """Return (n,) how many cells are clearly better and how many clearly worse than each; rows in order of errors."""
    n = len(rows)
    groups = together(rows)
    deviation, freedom = _own_errors(rows, groups)
    distinct, which = np.unique(freedom, return_inverse=True)
    wide = quantile(distinct) ** 2
    same = float(rows[0].get("equivalence") or 0.0)
    near_to = np.full(n, same)
    if rows[0]["metric"] == EXCESS.name:
        near_to = (np.sqrt(np.maximum(error, 0.0)) + same) ** 2 - np.maximum(error, 0.0)
    better, worse = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    for start in range(0, n, _STRIP):
        stop = min(start + _STRIP, n)
        lines, columns = slice(start, stop), slice(0, stop)  # only what stands before a cell can be better
        bound = np.add.outer(deviation[lines] ** 2, deviation[columns] ** 2)
        for group in groups:
            _less_covariance(bound, group, start, stop)
        np.maximum(bound, 0.0, out=bound)
        bound *= wide[0] if len(wide) == 1 else wide[np.minimum.outer(which[lines], which[columns])]
        ahead = np.subtract.outer(error[lines], error[columns])
        clear = ahead > 0
        clear &= np.square(ahead) > bound
        if same > 0:
            region = np.broadcast_to(near_to[columns], ahead.shape)
            near = np.nonzero(clear & (ahead <= region))
            clear[near] = ahead[near] + np.sqrt(bound[near]) > region[near]
        better[lines] = clear.sum(axis=1)
        worse[columns] += clear.sum(axis=0)
    return better, worse


def _less_covariance(bound: FloatArray, group: Together, start: int, stop: int) -> None:
    """Take twice the covariance of cells `start` … `stop` and those before from a sum of variances, in place."""
    first, last = np.searchsorted(group.places, [start, stop])
    if first == last:
        return
    product = group.influence[first:last] @ group.influence[:last].T
    product *= 2
    if product.shape == bound.shape:
        bound -= product
    else:
        bound[np.ix_(group.places[first:last] - start, group.places[:last])] -= product


def _own_errors(rows: Sequence[Row], groups: Sequence[Together]) -> tuple[FloatArray, FloatArray]:
    """Return (n,) standard errors and degrees of freedom: of the replicates, or else of the interval in the row."""
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
            deviation[place] = (high - low) / (2 * NORMAL)
    return deviation, freedom
