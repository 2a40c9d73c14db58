"""Ranks of cells with 95 % intervals, where cells that are not clearly different share a rank."""

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
    """Return the rank of each finished cell, except baselines, by the cell's name.

    Parameters
    ----------
    rows
        Rows to rank with each other: of the same task, protocol, split and hardware.

    Notes
    -----
    A cell is *clearly better* than another if its score is better, and the interval of their difference neither
    contains 0 nor lies within the task's region of practical equivalence. In order of scores, cells share a rank until
    a cell is clearly worse than all cells that share it; the rank of that cell is its position in the order.

    `low` and `high` are the best and worst ranks that pairwise comparisons do not exclude, extended to the shared rank:
    1 + the number of clearly better cells, and the number of cells, this one included, that are not clearly worse
    (Mogstad, Romano, Shaikh and Wilhelm 2024, Inference for ranks, at the level of a single pair).

    Errors of force are ranked by ``score² - floor²``, if all have a noise floor; the region of practical equivalence
    then applies to the roots: ``b² … (b + region)²`` for the better cell's root b.

    Differences are paired if two cells have the same replicates (:func:`together`); otherwise the errors of their
    scores are taken as independent. The interval is Student's, with the smaller degrees of freedom. If each replicate
    has a score of its own, mean and median must agree on the better cell. A row without replicates is never clear.
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
    """Return an (n, n) mask, True if cell i is clearly worse than cell j, and (n,) ranks, in order of errors."""
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
    """Return (n,) errors whose differences are tested, with their standard errors and degrees of freedom.

    These are `error`, or means over replicates that have scores; rows without replicates get infinite standard errors.
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
