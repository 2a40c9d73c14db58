"""Compare two cells: the difference of their scores, its interval and p-value, and a verdict.

The comparison is over replicates (:func:`difference`), or over folds whose training data overlap (:func:`over_folds`);
p-values of several comparisons are corrected by :func:`holm`.
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
    p: float | None
    """Two-sided p-value of no difference."""
    smallest_p: float | None
    """Smallest p-value that is possible with this number of replicates."""
    effect: float | None
    """Difference over the standard deviation of the replicates' differences."""
    improved: float | None
    """Share of replicates (if not paired, of pairs of replicates) on which the first cell is better, ties counting
    half; None if the metric is undefined on a replicate."""
    verdict: Verdict
    """Verdict on the first cell, relative to the second."""
    beyond: bool
    """True if the whole interval is outside the region of practical equivalence."""
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
    sign = -1.0 if lower_is_better(first["metric"]) else 1.0
    first, second = _means(first, second)
    value = float(first["score"] - second["score"])
    groups = together([first, second])
    if len(groups) == 1 and len(groups[0].places) == 2:
        return _paired(first, second, value, sign, groups[0])
    return _unpaired(first, second, value, sign, groups)


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
        method=f"not paired (the replicates differ), {method}",
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
    """Return the (replicates,) scores of a row's single replicates; NaN for a replicate with an undefined metric."""
    kept, n_classes = row["replicates"], len(row["classes"])
    if "scores" in kept:
        return scores_of(kept, row["metric"])
    metric = SUMMED[row["metric"]]
    return own_scores(metric, tables_of([kept], metric.name, n_classes)[0], n_classes)


def _share_better(apart: FloatArray) -> float | None:
    """Return the share of differences above 0, with zeros counted half; None if a difference is not finite."""
    return float(np.mean((np.sign(apart) + 1) / 2)) if np.isfinite(apart).all() else None


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


@dataclass(frozen=True)
class FoldDifference:
    """The mean difference of two cells' scores over folds, with its 95 % interval and p-value."""

    mean: float
    low: float
    high: float
    p: float
    method: str


def corrected_t(differences: Sequence[float], test_over_train: float) -> FoldDifference | None:
    """Return the corrected resampled t-test of differences over folds; None for fewer than two folds.

    `test_over_train` is the number of test rows over that of training rows, as a mean over folds.

    Notes
    -----
    ``t = d̄ / sqrt((1/n + n_test/n_train) s²)`` with n - 1 degrees of freedom. The second term allows for the
    correlation of folds that train on mostly the same rows; without it the test would too often find a difference
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
    """Return the corrected t-test of two cells over their common folds; None for fewer than two common folds.

    Return None also if the replicates differ, or for errors against the true force, which folds do not have.
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
