"""Compare two cells over replicates: the difference of their scores, its interval and p-value, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tactbench.core.evaluation.interval import influences, own_scores, student_quantile, tables_of, two_sided_p
from tactbench.core.evaluation.metrics import EXCESS, SUMMED
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.row import lower_is_better
from tactbench.core.statistics.replicates import FEWEST, counted

Row = Mapping[str, Any]
Verdict = Literal["better", "worse", "equivalent", "undecided"]
EXACT = 12
"""Largest number of replicates for which all 2^n exchanges of the two cells' answers are computed."""
EXCHANGES = 9_999
"""Number of random exchanges computed for more replicates than `EXACT`."""
SEED = 0x7AC7
"""Seed of the random exchanges, so that the same rows have the same p-value on any machine."""


@dataclass(frozen=True)
class PairableRows:
    """Result rows that were tested on the same replicates, so that their scores can be compared in pairs."""

    places: IntArray
    """(n,) indices of these rows in the sequence given to :func:`together`."""
    names: tuple[str, ...]
    strata: IntArray
    """(replicates,) stratum index of each replicate."""
    influence: FloatArray
    """(n, replicates) influence of each replicate on each score; over replicates, squares sum to a score's squared
    standard error, and products to the covariance of two scores."""
    freedom: float
    """Degrees of freedom of the standard errors."""


def together(rows: Sequence[Row]) -> list[PairableRows]:
    """Return groups of finished rows with the same replicates; rows without usable replicates are left out.

    The influence of a replicate on a score is computed by leaving that replicate out (:func:`influences`).
    """
    groups: dict[tuple[Any, ...], list[int]] = {}
    for place, row in enumerate(rows):
        kept = row.get("replicates")
        if kept:
            strata = tuple(kept["strata"] or [0] * len(kept["names"]))
            mark = tuple(kept["names"]), strata, "scores" in kept, tuple(row["classes"]), row["metric"]
            groups.setdefault(mark, []).append(place)
    found = []
    for (names, strata, scored, classes, metric), places in groups.items():
        several, n, codes = [rows[place]["replicates"] for place in places], len(names), np.array(strata)
        sizes = np.unique(codes, return_counts=True)[1]
        if sizes.min() < (FEWEST if scored else 2):
            continue
        if scored:  # the score is their mean
            scores = np.array([scores_of(one, metric) for one in several])
            influence = (scores - scores.mean(axis=1, keepdims=True)) / np.sqrt(n * (n - 1))
        else:
            sums = tables_of(several, metric, len(classes))
            without = sums.sum(axis=1, keepdims=True) - sums
            influence = influences(own_scores(SUMMED[metric], without, len(classes)), codes)
        good = np.isfinite(influence).all(axis=1)
        where = np.array(places, dtype=np.int64)[good]
        found.append(PairableRows(where, names, codes, influence[good], float(n - len(sizes))))
    return found


def scores_of(kept: Mapping[str, Any], metric: str) -> FloatArray:
    """Return the (replicates,) scores stored in a row's replicates; for ``excess_square``, those beyond the floor."""
    return np.asarray(kept["excess" if metric == EXCESS.name else "scores"], dtype=np.float64)


@dataclass(frozen=True)
class Difference:
    """The first cell's score minus the second cell's, in the metric's unit, with interval and tests."""

    value: float
    low: float | None
    high: float | None
    """Upper end of the 95 % interval from `low`; both None with too few replicates."""
    verdict: Verdict
    """Verdict on the first cell, relative to the second."""
    p: float | None
    """Two-sided p-value of no difference."""
    smallest_p: float | None
    """Smallest p-value that is possible with this number of replicates."""
    replicates: int
    """Number of common replicates if they are paired; else the smaller number of the two cells."""
    unit: str
    paired: bool
    method: str


def difference(first: Row, second: Row) -> Difference:
    """Compare the scores of two finished rows with the same metric.

    Notes
    -----
    If both cells were tested on replicates of the same names, the comparison is paired, with the jackknife's standard
    error (Efron and Stein 1981; Cameron, Gelbach and Miller 2008 on t with few clusters). The p-value is that of
    exchanging the two cells' answers within replicates: all 2^n exchanges up to 12 replicates, else 9,999 random ones
    (Phipson and Smyth 2010 on counting the observed one). If each replicate has a score of its own, the means over
    replicates are compared; for errors of force with a noise floor, means of the errors beyond the floor. If the
    replicates differ, the errors of the two scores are taken as independent, with the smaller degrees of freedom.

    The verdict is *equivalent* if the interval is within the task's region of practical equivalence; otherwise *better*
    or *worse* if the interval does not contain 0, else *undecided*. Ranks follow the same rule.
    """
    first, second = _means(first, second)
    value = float(first["score"] - second["score"])
    groups = together([first, second])
    if len(groups) == 1 and len(groups[0].places) == 2:
        return _paired(first, second, value, groups[0])
    return _unpaired(first, second, value, groups)


def _means(first: Row, second: Row) -> tuple[Row, Row]:
    """Return two rows with the mean over replicates as score, in place of the median, if replicates have scores.

    For errors of force, the mean is of the errors beyond the reference's noise floor, if both rows have such errors.
    """
    kept = [row.get("replicates") or {} for row in (first, second)]
    if not all("scores" in one for one in kept):
        return first, second
    key = "beyond" if all("beyond" in one for one in kept) else "scores"
    one, other = (
        {**row, "score": float(np.mean(mine[key])), "replicates": {**mine, "scores": mine[key], "of": key}}
        for row, mine in zip((first, second), kept, strict=True)
    )
    return one, other


def _paired(first: Row, second: Row, value: float, group: PairableRows) -> Difference:
    carried = group.influence[0] - group.influence[1]
    n, unit = len(group.names), str(first["replicates"]["unit"])
    p, smallest = exchanged(first, second)
    over = f"paired over {counted(n, unit)}"
    if first["replicates"].get("of") == "beyond":
        over += ", of the errors beyond the floor"
    method = f"{over}, Student's t ({group.freedom:.0f} degrees of freedom)"
    ends = _ends(first, value, float(np.sqrt(carried @ carried)), group.freedom)
    return Difference(value, *ends, p, smallest, n, unit, paired=True, method=method)


def _unpaired(first: Row, second: Row, value: float, groups: list[PairableRows]) -> Difference:
    unit = " and ".join(dict.fromkeys(str(row["replicates"].get("unit", "none")) for row in (first, second)))
    if len(groups) < 2:
        method = f"too few replicates: an interval needs {FEWEST}"
        return Difference(value, None, None, "undecided", None, None, 0, unit, paired=False, method=method)
    deviation = float(np.sqrt(sum((group.influence**2).sum() for group in groups)))
    freedom = min(group.freedom for group in groups)
    p = two_sided_p(value / deviation, freedom) if deviation > 0 else None
    method = "not paired (the replicates differ), Student's t (the smaller of two degrees of freedom)"
    n = min(len(group.names) for group in groups)
    ends = _ends(first, value, deviation, freedom)
    return Difference(value, *ends, p, None if p is None else 0.0, n, unit, paired=False, method=method)


def _ends(first: Row, value: float, deviation: float, freedom: float) -> tuple[float, float, Verdict]:
    """Return the ends of the interval of a difference with this standard error, and the verdict on the first row."""
    reach, region = float(student_quantile(freedom)) * deviation, float(first.get("equivalence") or 0.0)
    low, high = value - reach, value + reach
    if region > 0 and -region <= low and high <= region:
        return low, high, "equivalent"
    if low <= 0 <= high:
        return low, high, "undecided"
    return low, high, "better" if (value < 0) == lower_is_better(first["metric"]) else "worse"


def exchanged(first: Row, second: Row) -> tuple[float, float]:
    """Return the p-value of exchanging two rows' answers within common replicates, and the smallest possible one."""
    name = first["metric"]
    if "scores" in first["replicates"]:
        apart_each = scores_of(first["replicates"], name) - scores_of(second["replicates"], name)
        ways, smallest = _ways(len(apart_each))
        return _share((1.0 - 2.0 * ways) @ apart_each), smallest
    metric, n_classes = SUMMED[name], len(first["classes"])
    sums = tables_of([first["replicates"], second["replicates"]], metric.name, n_classes)
    ways, smallest = _ways(sums.shape[1])
    moved = ways.astype(np.float64) @ (sums[1] - sums[0])
    one, other = sums.sum(axis=1)
    return _share(own_scores(metric, one + moved, n_classes) - own_scores(metric, other - moved, n_classes)), smallest


def _ways(n: int) -> tuple[IntArray, float]:
    """Return (exchanges, n) ones for replicates to exchange (first row: none), and the smallest possible p-value."""
    if n <= EXACT:
        return (np.arange(2**n)[:, None] >> np.arange(n)) & 1, 2.0 / 2**n
    drawn = np.random.default_rng(SEED).integers(0, 2, size=(EXCHANGES, n))
    ways = np.concatenate([np.zeros((1, n), dtype=np.int64), drawn])  # as it was is one of the ways
    return ways, 1.0 / len(ways)


def _share(apart: FloatArray) -> float:
    """Return the share of exchanges whose absolute difference is at least that of the first, without exchange."""
    apart = np.abs(apart[np.isfinite(apart)])
    return float(np.mean(apart >= apart[0] * (1 - 1e-9) - 1e-15))


def holm(p: Sequence[float | None]) -> list[float | None]:
    """Return p-values corrected for multiple comparisons; None, for a comparison without p-value, stays None.

    Notes
    -----
    Holm 1979, A simple sequentially rejective multiple test procedure: the k-th smallest of m p-values is multiplied
    by m - k + 1, limited to 1, and raised to the corrected value before it if smaller. This controls the probability
    of any false finding, for any dependence between the comparisons.
    """
    made = sorted((value, place) for place, value in enumerate(p) if value is not None)
    corrected: list[float | None] = [None] * len(p)
    least = 0.0
    for rank, (value, place) in enumerate(made):
        least = max(least, min(1.0, (len(made) - rank) * value))
        corrected[place] = least
    return corrected
