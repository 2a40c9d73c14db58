"""How much each replicate carries of a score: what intervals of differences and ranks are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.jackknife import influences
from tactbench.core.evaluation.metrics import EXCESS, SUMMED, Metric
from tactbench.core.evaluation.replicate_sums import tables_of
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.statistics.median import FEWEST

Row = Mapping[str, Any]
_Carried = tuple[npt.NDArray[np.bool_], FloatArray, FloatArray, FloatArray]
"""Which rows are sound, and their influences, degrees of freedom and runs."""


@dataclass(frozen=True)
class PairableRows:
    """Rows that were tested on the same replicates, and so can be paired."""

    places: IntArray
    """(n,) which of the rows given"""
    names: tuple[str, ...]
    strata: IntArray
    """(replicates,) which replicates may stand in for each other"""
    in_time: bool
    """the replicates are blocks of time: the spread between sessions is not in them"""
    influence: FloatArray
    """(n, replicates): a score's squared standard error is the sum of their squares, the covariance of two scores that
    of their products"""
    freedom: FloatArray
    """(n,) degrees of freedom of the standard error"""
    runs: FloatArray
    """(n,) how many neighbouring replicates depend on each other"""


def together(rows: Sequence[Row]) -> list[PairableRows]:
    """Return the rows in groups of equal replicates; rows without usable replicates are in none.

    Parameters
    ----------
    rows
        Finished rows of one metric.

    Notes
    -----
    The influence of a replicate is what leaving it out changes (:func:`influences`). Where the replicates are blocks of
    time that depend on their neighbours, influences are smoothed so that the sums of squares become those of Bartlett's
    window (Künsch 1989), to which a circular block bootstrap converges.
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    for place, row in enumerate(rows):
        mark = _mark(row)
        if mark is not None:
            groups.setdefault(mark, []).append(place)
    found = []
    for (names, strata, in_time, n_classes, metric), places in groups.items():
        one = _group([rows[place]["replicates"] for place in places], SUMMED[metric], n_classes, strata, len(names))
        if one is not None:
            good, influence, freedom, runs = one
            codes = np.array(strata or [0] * len(names), dtype=np.int64)
            where = np.array(places, dtype=np.int64)[good]
            found.append(PairableRows(where, names, codes, in_time, influence[good], freedom[good], runs[good]))
    return found


def _mark(row: Row) -> tuple[Any, ...] | None:
    """Return what two rows must have in common to be paired; None if a row has nothing to resample."""
    kept = row.get("replicates")
    if not kept or row["metric"] not in SUMMED:
        return None
    try:
        if "scores" in kept and len(kept["names"]) < FEWEST:
            return None
        strata = None if kept["strata"] is None else tuple(int(one) for one in kept["strata"])
        names = tuple(str(one) for one in kept["names"])
        return names, strata, str(kept["unit"]).startswith("block"), len(row["classes"]), row["metric"]
    except (KeyError, TypeError, ValueError, OverflowError):
        return None


def _group(
    kept: list[dict[str, Any]], metric: Metric, n_classes: int, strata: tuple[int, ...] | None, replicates: int
) -> _Carried | None:
    if any("scores" in one for one in kept):
        return _of_scores(kept, metric, replicates)
    codes = np.zeros(replicates, dtype=np.int64) if strata is None else np.array(strata, dtype=np.int64)
    sizes = np.unique(codes, return_counts=True)[1] if len(codes) == replicates else np.zeros(1)
    if not replicates or sizes.min() < 2:
        return None
    try:
        sums = tables_of(kept, metric.name, n_classes)
        runs = np.clip([float(one.get("run", 1)) for one in kept], 1.0, float(replicates))
        with np.errstate(divide="ignore", invalid="ignore"):
            without = metric.score(sums.sum(axis=1, keepdims=True) - sums, n_classes)
    except (ValueError, IndexError, TypeError, KeyError):
        if len(kept) == 1:
            return None
        return _one_by_one(kept, metric, n_classes, strata, replicates)
    if sums.shape[1] != replicates:
        return None
    influence = influences(without, codes)
    for one in np.unique(codes):
        influence[:, codes == one] = _smoothed(influence[:, codes == one], runs)
    freedom = np.maximum(replicates / runs - len(sizes), 1.0)
    return np.isfinite(influence).all(axis=1) & np.isfinite(runs), influence, freedom, runs


def _of_scores(kept: list[dict[str, Any]], metric: Metric, replicates: int) -> _Carried | None:
    """Return what replicates with a score of their own carry of the mean over replicates."""
    try:
        scores = np.array([scores_of(one, metric.name) for one in kept], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        return None
    if scores.shape != (len(kept), replicates):
        return None
    influence = (scores - scores.mean(axis=1, keepdims=True)) / np.sqrt(replicates * (replicates - 1))
    alike = np.ones(len(kept))
    return np.isfinite(influence).all(axis=1), influence, alike * (replicates - 1), alike


def scores_of(kept: Mapping[str, Any], metric: str) -> FloatArray:
    """Return (replicates,) scores that a row keeps of its replicates: of `metric`, or of what is beyond the floor."""
    return np.asarray(kept["excess" if metric == EXCESS.name else "scores"], dtype=np.float64)


def _one_by_one(
    kept: list[dict[str, Any]], metric: Metric, n_classes: int, strata: tuple[int, ...] | None, replicates: int
) -> _Carried:
    """Keep one row of another shape from spoiling the rest."""
    each = [_group([one], metric, n_classes, strata, replicates) for one in kept]
    good = np.array([one is not None and bool(one[0][0]) for one in each])
    influence = np.vstack([np.zeros(replicates) if one is None else one[1][0] for one in each])
    freedom = np.array([1.0 if one is None else one[2][0] for one in each])
    runs = np.array([1.0 if one is None else one[3][0] for one in each])
    return good, influence, freedom, runs


def _smoothed(influence: FloatArray, runs: FloatArray) -> FloatArray:
    """Return (n, blocks) whose sums of products are those of all circular runs of `runs` blocks, (n,), together.

    The factor is the root of Fejér's kernel, which has no phase: rows of different run can still be multiplied.
    """
    if (runs <= 1).all():
        return influence
    n = influence.shape[1]
    out = influence.copy()
    frequency = np.arange(n // 2 + 1) / n
    for run in np.unique(runs[runs > 1]).tolist():
        response = np.abs(np.exp(-2j * np.pi * np.outer(frequency, np.arange(int(run)))).sum(axis=1)) / np.sqrt(run)
        mine = runs == run
        out[mine] = np.fft.irfft(np.fft.rfft(influence[mine], axis=1) * response, n, axis=1)
    return out
