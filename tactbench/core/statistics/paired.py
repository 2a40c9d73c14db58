"""Two cells compared: the difference of their scores, how sure it is, and whether it matters.

Over replicates (:func:`difference`), or over folds whose training data overlap (:func:`over_folds`); several
comparisons at once are corrected for being several (:func:`holm`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tactbench.core.evaluation.interval import influences, own_scores, student_quantile, two_sided_p
from tactbench.core.evaluation.metrics import EXCESS, SUMMED
from tactbench.core.evaluation.replicate_sums import tables_of
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.row import TRUE, lower_is_better
from tactbench.core.statistics.replicates import FEWEST, counted

Row = Mapping[str, Any]
Verdict = Literal["better", "worse", "equivalent", "undecided"]
EXACT = 12
"""Up to so many replicates, all ways of exchanging the two are tried."""
EXCHANGES = 9_999
"""Ways tried of more."""
SEED = 0x7AC7
"""Of these ways: the same rows have the same p-value, on any machine."""


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

    The influence of a replicate is the change of the score without it (:func:`influences`).
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
    """Return (replicates,) scores that a row keeps of its replicates: of `metric`, or beyond the floor."""
    return np.asarray(kept["excess" if metric == EXCESS.name else "scores"], dtype=np.float64)


@dataclass(frozen=True)
class Difference:
    """One cell's score less another's, in the metric's unit."""

    value: float
    low: float | None
    high: float | None
    """95 % interval; None: nothing can be resampled"""
    p: float | None
    """two-sided, of no difference"""
    smallest_p: float | None
    """the least that so few replicates can give"""
    effect: float | None
    """difference over the standard deviation of the replicates' differences"""
    improved: float | None
    """share of replicates (not paired: of pairs of them) on which the first is better, ties half; None where the metric
    of one replicate is undefined"""
    verdict: Verdict
    """of the first cell"""
    beyond: bool
    """the whole interval is beyond the region of practical equivalence"""
    replicates: int
    """how many both have, where they are paired; else the fewer of the two"""
    unit: str
    paired: bool
    method: str


def difference(first: Row, second: Row) -> Difference:
    """Compare two finished rows of one metric.

    Notes
    -----
    Where both were tested on replicates of the same names, differences are taken replicate by replicate, by the
    jackknife's standard error (Efron and Stein 1981; Cameron, Gelbach and Miller 2008 on t with few clusters). The
    p-value is that of exchanging the two answers within replicates: all 2^n ways up to 12 replicates, else 9,999 drawn
    (Phipson and Smyth 2010 on counting the observed one). Where each replicate has a score of its own, the difference
    is that of the means over replicates; of errors of force that have a floor, of the errors beyond it. Where the
    replicates differ, errors are taken as independent, and of two degrees of freedom the smaller.

    The verdict is *better* or *worse* if the interval neither contains 0 nor lies within the task's region of practical
    equivalence, *equivalent* if it lies within, else *undecided*: ranks follow the same rule.
    """
    sign = -1.0 if lower_is_better(first["metric"]) else 1.0
    first, second = _means(first, second)
    value = float(first["score"] - second["score"])
    groups = together([first, second])
    if len(groups) == 1 and len(groups[0].places) == 2:
        return _paired(first, second, value, sign, groups[0])
    return _unpaired(first, second, value, sign, groups)


def _means(first: Row, second: Row) -> tuple[Row, Row]:
    """Return rows whose replicates have scores of their own with the mean in place of the median.

    Errors of force are those beyond the floor of the reference, if both rows have them.
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


def _paired(first: Row, second: Row, value: float, sign: float, group: PairableRows) -> Difference:
    carried = group.influence[0] - group.influence[1]
    deviation = float(np.sqrt(carried @ carried))
    n = len(group.names)
    p, smallest = exchanged(first, second)
    unit = str(first["replicates"]["unit"])
    over = f"paired over {counted(n, unit)}"
    if first["replicates"].get("of") == "beyond":
        over += ", of the errors beyond the floor"
    return _difference(
        first, value, deviation, group.freedom,
        p=p,
        smallest_p=smallest,
        effect=value / (deviation * np.sqrt(n)) if deviation > 0 else None,
        improved=_share_better(sign * (_own_scores(first) - _own_scores(second))),
        replicates=n,
        unit=unit,
        paired=True,
        method=f"{over}, Student's t ({group.freedom:.0f} degrees of freedom)",
    )  # fmt: skip


def _unpaired(first: Row, second: Row, value: float, sign: float, groups: list[PairableRows]) -> Difference:
    method = "Student's t (of two degrees of freedom the smaller)"
    unit = " and ".join(dict.fromkeys(str(row["replicates"].get("unit", "none")) for row in (first, second)))
    if len(groups) < 2:
        known: dict[str, Any] = dict.fromkeys(("p", "smallest_p", "effect", "improved"))
        return _difference(
            first, value, np.inf, np.inf,
            **known, replicates=0, unit=unit, paired=False, method=f"too few replicates: an interval needs {FEWEST}",
        )  # fmt: skip
    one, other = sorted(groups, key=lambda group: int(group.places[0]))
    deviation = float(np.sqrt((one.influence**2).sum() + (other.influence**2).sum()))
    spread = float(np.sqrt(sum(len(group.names) * (group.influence**2).sum() for group in (one, other)) / 2))
    freedom = min(one.freedom, other.freedom)
    return _difference(
        first, value, deviation, freedom,
        p=two_sided_p(value / deviation, freedom) if deviation > 0 else None,
        smallest_p=0.0 if deviation > 0 else None,
        effect=value / spread if spread > 0 else None,
        improved=_share_better(sign * np.subtract.outer(_own_scores(first), _own_scores(second))),
        replicates=min(len(one.names), len(other.names)),
        unit=unit,
        paired=False,
        method=f"not paired (they have other replicates), {method}",
    )  # fmt: skip


def _difference(first: Row, value: float, deviation: float, freedom: float, **more: Any) -> Difference:
    if not np.isfinite(deviation):
        return Difference(value, None, None, verdict="undecided", beyond=False, **more)
    reach, region = float(student_quantile(freedom)) * deviation, float(first.get("equivalence") or 0.0)
    low, high = value - reach, value + reach
    verdict: Verdict = "undecided"
    if region > 0 and -region <= low and high <= region:
        verdict = "equivalent"
    elif low > 0 or high < 0:
        verdict = "better" if (value < 0) == lower_is_better(first["metric"]) else "worse"
    return Difference(value, low, high, verdict=verdict, beyond=bool(low > region or high < -region), **more)


def _own_scores(row: Row) -> FloatArray:
    """Return (replicates,) the score of each replicate by itself; NaN where the metric of it is undefined."""
    kept, n_classes = row["replicates"], len(row["classes"])
    if "scores" in kept:
        return scores_of(kept, row["metric"])
    metric = SUMMED[row["metric"]]
    return own_scores(metric, tables_of([kept], metric.name, n_classes)[0], n_classes)


def _share_better(apart: FloatArray) -> float | None:
    """Return the share of differences above 0, of those that are 0 half; None where one is not finite."""
    return float(np.mean((np.sign(apart) + 1) / 2)) if np.isfinite(apart).all() else None


def exchanged(first: Row, second: Row) -> tuple[float, float]:
    """Return the p-value of exchanging two rows' answers within the replicates they share, and the least it can be."""
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
    """Return (ways, n) which of n replicates are exchanged, at first none, and the least p that so many ways give."""
    if n <= EXACT:
        return (np.arange(2**n)[:, None] >> np.arange(n)) & 1, 2.0 / 2**n
    drawn = np.random.default_rng(SEED).integers(0, 2, size=(EXCHANGES, n))
    ways = np.concatenate([np.zeros((1, n), dtype=np.int64), drawn])  # as it was is one of the ways
    return ways, 1.0 / len(ways)


def _share(apart: FloatArray) -> float:
    """Return the share of ways whose difference is at least that of the first."""
    apart = np.abs(apart[np.isfinite(apart)])
    return float(np.mean(apart >= apart[0] * (1 - 1e-9) - 1e-15))


@dataclass(frozen=True)
class FoldDifference:
    """The mean difference over folds, with its interval and p-value."""

    mean: float
    low: float
    high: float
    p: float
    method: str


def corrected_t(differences: Sequence[float], test_over_train: float) -> FoldDifference | None:
    """Return the corrected resampled t-test of differences over folds; None of fewer than two.

    `test_over_train` is test rows over training rows of a fold; of unequal folds, the mean.

    Notes
    -----
    ``t = d̄ / sqrt((1/n + n_test/n_train) s²)`` with n - 1 degrees of freedom. The second term stands for the
    correlation of folds that train on mostly the same rows; without it the test finds differences that are not there
    (Nadeau and Bengio 2003, Inference for the generalization error).
    """
    d = np.asarray(differences, dtype=np.float64)
    n = len(d)
    if n < 2:
        return None
    deviation = float(np.sqrt((1 / n + test_over_train) * d.var(ddof=1)))
    mean = float(d.mean())
    reach = float(student_quantile(n - 1)) * deviation
    p = two_sided_p(mean / deviation, n - 1) if deviation > 0 else float(mean == 0)
    method = f"corrected resampled t (Nadeau and Bengio) over {n} folds"
    return FoldDifference(mean, mean - reach, mean + reach, p, method)


def over_folds(first: Row, second: Row) -> FoldDifference | None:
    """Return the corrected test of two cells over the folds that both have; None where those hold out other units.

    None also of errors against the true force: scores of folds are against the reference.
    """
    if (
        first["metric"].startswith(TRUE)
        or len({tuple((row.get("replicates") or {}).get("names", ())) for row in (first, second)}) > 1
    ):
        return None
    sizes, other = first.get("fold_sizes") or {}, second.get("fold_sizes") or {}
    both = [name for name in sizes if name in other and name in first["scores"] and name in second["scores"]]
    if len(both) < 2:
        return None
    ratios = [sizes[name][1] / sizes[name][0] for name in both]
    return corrected_t([first["scores"][name] - second["scores"][name] for name in both], float(np.mean(ratios)))


def holm(p: Sequence[float | None]) -> list[float | None]:
    """Return p-values corrected for being several; None, of a comparison that could not be made, does not count.

    Notes
    -----
    Holm 1979, A simple sequentially rejective multiple test procedure: the k-th smallest of m is multiplied by
    m - k + 1, never below that of a smaller one, never above 1. It controls the probability of any false finding
    whatever the dependence between the comparisons.
    """
    made = sorted((value, place) for place, value in enumerate(p) if value is not None)
    corrected: list[float | None] = [None] * len(p)
    least = 0.0
    for rank, (value, place) in enumerate(made):
        least = max(least, min(1.0, (len(made) - rank) * value))
        corrected[place] = least
    return corrected
