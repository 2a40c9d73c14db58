"""How much each replicate carries of a score: what intervals of differences and ranks are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.core.evaluation.interval import influences
from tactbench.core.evaluation.metrics import EXCESS, SUMMED
from tactbench.core.evaluation.replicate_sums import tables_of
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.statistics.replicates import FEWEST

Row = Mapping[str, Any]


@dataclass(frozen=True)
class PairableRows:
    """Rows that were tested on the same replicates, and so can be paired."""

    places: IntArray
    """(n,) which of the rows given"""
    names: tuple[str, ...]
    strata: IntArray
    """(replicates,) which replicates may stand in for each other"""
    influence: FloatArray
    """(n, replicates): a score's squared standard error is the sum of their squares, the covariance of two scores that
    of their products"""
    freedom: float
    """degrees of freedom of the standard errors"""


def together(rows: Sequence[Row]) -> list[PairableRows]:
    """Return finished rows of one metric in groups of equal replicates; rows without usable ones are in none.

    The influence of a replicate is what leaving it out changes (:func:`influences`).
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    for place, row in enumerate(rows):
        kept = row.get("replicates")
        if kept:
            strata = tuple(kept["strata"] or [0] * len(kept["names"]))
            mark = tuple(kept["names"]), strata, "scores" in kept, tuple(row["classes"]), row["metric"]
            groups.setdefault(mark, []).append(place)
    found = []
    for (names, strata, own_scores, classes, metric), places in groups.items():
        several, n, codes = [rows[place]["replicates"] for place in places], len(names), np.array(strata)
        sizes = np.unique(codes, return_counts=True)[1]
        if sizes.min() < (FEWEST if own_scores else 2):
            continue
        if own_scores:  # what is asked for is their mean
            scores = np.array([scores_of(one, metric) for one in several])
            influence = (scores - scores.mean(axis=1, keepdims=True)) / np.sqrt(n * (n - 1))
        else:
            influence = influences(scores_without(several, metric, len(classes)), codes)
        good = np.isfinite(influence).all(axis=1)
        where = np.array(places, dtype=np.int64)[good]
        found.append(PairableRows(where, names, codes, influence[good], float(n - len(sizes))))
    return found


def scores_of(kept: Mapping[str, Any], metric: str) -> FloatArray:
    """Return (replicates,) scores that a row keeps of its replicates: of `metric`, or of what is beyond the floor."""
    return np.asarray(kept["excess" if metric == EXCESS.name else "scores"], dtype=np.float64)


def scores_without(several: Sequence[dict[str, Any]], metric: str, n_classes: int) -> FloatArray:
    """Return (rows, replicates) scores without each replicate, from the sums that rows with equal names keep."""
    sums = tables_of(several, metric, n_classes)
    with np.errstate(divide="ignore", invalid="ignore"):
        return SUMMED[metric].score(sums.sum(axis=1, keepdims=True) - sums, n_classes)
