"""Ranks that may be believed: ties share one, and each has an interval."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.interval import student_quantile
from tactbench.core.evaluation.metrics import EXCESS
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.row import lower_is_better
from tactbench.core.statistics.paired import PairableRows, scores_of, together
from tactbench.core.statistics.rank import Rank, beyond_floor, excess_of

Row = Mapping[str, Any]


def ranks(rows: Iterable[Row]) -> dict[str, Rank]:
    """Return the rank of each finished cell that is no baseline, by its name.

    Parameters
    ----------
    rows
        Rows of one block: of the same task, protocol, split and hardware.

    Notes
    -----
    A cell is *clearly better* than another if its score is, and the interval of their difference neither contains 0 nor
    lies within the task's region of practical equivalence. Cells in order of their scores share a place until one comes
    that all of those sharing it are clearly better than: it takes the place of its number in that order.

    `low` and `high` are the ranks that no comparison of two excludes, the shared place among them: 1 + the number of
    cells that are clearly better, and the number of cells that are not clearly worse, itself among them (Mogstad,
    Romano, Shaikh and Wilhelm 2024, Inference for ranks, at the level of a single pair).

    Errors of force are ranked by ``score² - floor²``, if all have a floor; the region of practical equivalence is that
    of the roots: ``b² … (b + region)²`` for the better one's b.

    Differences are paired over replicates where two cells have the same (:func:`together`), else their errors are taken
    as independent; their interval is Student's, of two degrees of freedom the smaller. Where each replicate has a score
    of its own, the better median must agree with it. A row without replicates is separated from none.
    """
    entered = [row for row in rows if row["status"] == "done" and not row["is_baseline"]]
    if not entered:
        return {}
    if beyond_floor(entered):
        entered = [{**row, "score": excess_of(row), "metric": EXCESS.name} for row in entered]
    sign = -1.0 if lower_is_better(entered[0]["metric"]) else 1.0
    entered.sort(key=lambda row: (-sign * row["score"], row["cell"]))
    error = -sign * np.array([row["score"] for row in entered], dtype=np.float64)  # the lower, the better
    groups = together(entered)
    clear, places = _clearly(entered, groups, error)
    better, worse = clear.sum(axis=1), clear.sum(axis=0)
    low = np.minimum(1 + better, places)
    high = np.maximum(len(entered) - worse, places)
    many = np.bincount(places)
    return {
        row["cell"]: Rank(int(places[i]), int(low[i]), int(high[i]), bool(many[places[i]] > 1), bool(clear[i, 0]))
        for i, row in enumerate(entered)
    }


def _clearly(
    rows: Sequence[Row], groups: Sequence[PairableRows], error: FloatArray
) -> tuple[npt.NDArray[np.bool_], IntArray]:
    """Return (n, n) whether a cell is clearly worse than another, and (n,) places, in order of errors."""
    n = len(rows)
    mean, deviation, freedom = _differed(rows, groups, error)
    distinct, which = np.unique(freedom, return_inverse=True)
    wide = student_quantile(distinct) ** 2
    same = float(rows[0].get("equivalence") or 0.0)
    near_to = np.full(n, same)
    if rows[0]["metric"] == EXCESS.name:
        near_to = (np.sqrt(np.maximum(error, 0.0)) + same) ** 2 - np.maximum(error, 0.0)
    variance = np.add.outer(deviation**2, deviation**2)
    for group in groups:
        variance[np.ix_(group.places, group.places)] -= 2 * (group.influence @ group.influence.T)
    bound = wide[np.minimum.outer(which, which)] * np.maximum(variance, 0.0)
    ahead = np.subtract.outer(mean, mean)  # only cells before it can be better
    clear = np.tril(np.subtract.outer(error, error) > 0) & (ahead > 0) & (ahead**2 > bound)
    if same > 0:
        clear &= ~(ahead <= near_to) | (ahead + np.sqrt(bound) > near_to)
    places = np.ones(n, dtype=np.int64)
    first = 0  # of those that share the place of the cell before
    for place in range(1, n):
        if clear[place, first:place].all():
            first = place
        places[place] = first + 1
    return clear, places


def _differed(
    rows: Sequence[Row], groups: Sequence[PairableRows], error: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (n,) numbers whose differences are tested, their standard errors and degrees of freedom.

    That is `error`, or the mean over replicates with scores of their own; a row without replicates has infinite ones.
    """
    mean, deviation, freedom = error.copy(), np.full(len(rows), np.inf), np.full(len(rows), np.inf)
    metric = rows[0]["metric"]
    for group in groups:
        deviation[group.places] = np.linalg.norm(group.influence, axis=1)
        freedom[group.places] = group.freedom
        for place in group.places.tolist():
            kept = rows[place]["replicates"]
            if "scores" in kept:
                mean[place] = (1.0 if lower_is_better(metric) else -1.0) * scores_of(kept, metric).mean()
    return mean, deviation, freedom
