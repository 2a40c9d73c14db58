"""Interval of a score over units that a split holds out (sessions, objects …), and the sums over each unit.

The sums over each unit are kept in a result, to compare scores later without the answers::

    {"unit": "session",                  word for a replicate
     "names": ["s1", "s2", …],           sorted names of replicates: two rows with the same names can be paired
     "strata": [0, 0, 1, …] or None,     stratum of each replicate, for the jackknife; None: all in one stratum
     "sums": [[…], …]                    sums of the metric's summands over each replicate
     "own": [0.61, …]                    score of each replicate by itself; None where the metric is undefined
     "floor": [[…, …], …],               for a RMSE with a noise floor: sums of squares and degrees of freedom of the
                                         reference's unloaded holds, for each replicate
     "scores": [0.63, …],                for a caller's own metric, in place of sums: the jackknife's pseudo-values,
                                         whose mean estimates the score and whose spread its standard error
     "true": {"sums": …, "own": …}       for an error of force: both against the force that a simulated rig exerted

The summands of a classification are a flat table of true and given classes, mostly zero, so that a line of sums is
``column, count, column, count …``. :attr:`Metric.score` of the sum of all lines is exactly the row's score.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset, at_rows
from tactbench.core.evaluation.metrics import EXCESS, Metric, confusion
from tactbench.core.samples import Answers, FloatArray, IntArray
from tactbench.core.spec.row import plural

LEVEL = 0.95
ENOUGH_UNITS = 5
"""Smallest number of units for an interval: fewer units do not show how units differ."""
FURTHEST = 10.0
"""Multiple of an error above which the upper end of the error's interval is left open: few units may not bound it."""
_MOST_FREEDOM = 1e9
"""Degrees of freedom above which Student's t equals the normal distribution to all digits."""


@dataclass(frozen=True)
class Interval:
    """The 95 % confidence interval of a score, and the method of its computation."""

    low: float | None = None
    """Lower end; None if there are too few units for an interval."""
    high: float | None = None
    """Upper end; None if there is no interval, or if the data do not bound an error from above."""
    method: str = ""


@dataclass(frozen=True)
class ReplicateUnits:
    """The units that a split holds out, such as sessions or objects, and the unit of each test row."""

    name: str
    """Word for one unit, such as session or object."""
    codes: IntArray
    """(n,) index in `labels` of the unit to which each test row belongs."""
    labels: tuple[str, ...]
    """Name of each unit."""

    def sums(self, rows: FloatArray) -> FloatArray:
        """Return the (units, m) sums of (n, m) summands over the rows of each unit."""
        out = np.zeros((int(self.codes.max()) + 1, rows.shape[1]))
        np.add.at(out, self.codes, rows)
        return out

    def enough(self, y: npt.NDArray[Any], n_classes: int) -> bool:
        """Return True if there are enough units for an interval, in all and with each class in the (n,) labels."""
        each = [y == one for one in range(n_classes)]
        own = [self.codes, *(self.codes[mask] for mask in each if mask.any())]
        return all(len(np.unique(codes)) >= ENOUGH_UNITS for codes in own)

    def strata(self, y: npt.NDArray[Any], n_classes: int) -> IntArray:
        """Return the (units,) index of each unit's stratum; the jackknife is computed within strata.

        If each unit has rows of one class only, the units of each class are a stratum, as a score without a class
        answers another question; otherwise all units are one stratum.
        """
        there = np.zeros((int(self.codes.max()) + 1, max(n_classes, 1)), dtype=bool)
        there[self.codes, y if n_classes else 0] = True
        if (there.sum(axis=1) > 1).any():
            return np.zeros(len(there), dtype=np.int64)
        return np.unique(there.argmax(axis=1), return_inverse=True)[1].astype(np.int64)


def score_interval(
    metric: Metric, y: npt.NDArray[Any], predicted: npt.NDArray[Any], unit: ReplicateUnits, n_classes: int
) -> Interval:
    """Return the interval of ``metric.of(y, predicted)``, without ends if fewer than five units, in all or of a class.

    Notes
    -----
    Each unit is left out in turn (jackknife, within strata where units have one class each), and the interval is
    Student's over units [1]_, on a scale that suits the metric (:func:`transform_of`). Errors have half the degrees of
    freedom, since squared offsets between units are long-tailed (Box 1953, Non-normality and tests on variances).
    Shares near 1 with few mistakes have ends from the binomial distribution [2]_, and shares near 0 mirrored ends.
    docs/statistics.md, section 2, gives the reasons; ``benchmarks/coverage.py`` measures the coverage.

    References
    ----------
    .. [1] Cameron, Gelbach and Miller 2008, Bootstrap-based improvements for inference with clustered errors.
    .. [2] Clopper and Pearson 1934, The use of confidence or fiducial limits illustrated in the case of the binomial.
    """
    if not unit.enough(y, n_classes):
        return Interval()
    own, without = unit_scores(metric, y, predicted, unit, n_classes)
    if np.isfinite(own).sum() < ENOUGH_UNITS:
        return Interval()
    strata, score = unit.strata(y, n_classes), metric.of(y, predicted, n_classes)
    scale = transform_of(metric, score, len(y))
    without = scale.there(without)
    without = np.where(np.isfinite(without), without, scale.there(score))  # R² of labels that are all alike
    n = len(own)
    freedom = (n - len(np.unique(strata))) / (2 if metric.kind == "regression" else 1)
    method = f"jackknife over {n} {plural(unit.name)} (Student's t, {freedom:g} degrees of freedom, {scale.name})"
    reach = float(student_quantile(freedom)) * float(np.sqrt((influences(without, strata) ** 2).sum()))
    ends = [float(scale.back(scale.there(score) + one * reach)) for one in (-1.0, 1.0)]
    low, high = min(*ends, score), max(*ends, score)
    if metric.kind != "regression" and metric.function is None:
        sums = unit.sums(metric.rows(y, predicted, n_classes))
        if metric.kind == "events":
            right, asked = sums.T
        else:
            right, asked = np.trace(confusion(sums, n_classes), axis1=1, axis2=2), sums.sum(axis=1)
        near_0 = score < 1 / n
        few = right if near_0 else asked - right
        if (near_0 or 1 - score < 1 / n) and _few(few):
            number, what = int(np.count_nonzero(few)), "right answer" if near_0 else "mistake"
            mirrored = (1 - score, 1 - high, 1 - low) if near_0 else (score, low, high)
            low, high = _few_mistakes(*mirrored, number, n)
            low, high = (1 - high, 1 - low) if near_0 else (low, high)
            method += f"; {number} of them with a {what} (Clopper and Pearson)"
    return Interval(low, high if np.isfinite(high) else None, method)


def _few(each: FloatArray) -> bool:
    """Return True if (units,) counts are too few to show how units differ: sum at most 2, or over two thirds are 0."""
    return bool(each.sum() <= 2 or np.count_nonzero(each) < len(each) / 3)


def _few_mistakes(score: float, low: float, high: float, wrong: int, n: int) -> tuple[float, float]:
    """Return the binomial ends of the interval of a share near 1, if `wrong` of `n` units have a mistake."""
    tail = 0.5 - LEVEL / 2
    low = (low if wrong else 1.0) * tail ** (1 / n)
    if not wrong:
        return low, 1.0
    rare = importlib.import_module("scipy.special").betaincinv(wrong, n - wrong + 1, tail)
    return low, max(high, 1 - (1 - score) * float(rare) * n / wrong)


def unit_scores(
    metric: Metric, y: npt.NDArray[Any], predicted: npt.NDArray[Any], unit: ReplicateUnits, n_classes: int
) -> tuple[FloatArray, FloatArray]:
    """Return the (units,) scores on the rows of each unit, and the (units,) scores on all rows but that unit's."""
    if metric.function is not None:
        each = [unit.codes == code for code in range(len(unit.labels))]
        own, others = ([metric.of(y[mask ^ out], predicted[mask ^ out]) for mask in each] for out in (False, True))
        return np.array(own), np.array(others)
    sums = unit.sums(metric.rows(y, predicted, n_classes))
    return own_scores(metric, sums, n_classes), own_scores(metric, sums.sum(axis=0) - sums, n_classes)


def own_scores(metric: Metric, sums: FloatArray, n_classes: int) -> FloatArray:
    """Return the (units,) scores of single units from (units, m) sums; not finite where the metric is undefined."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return metric.score(sums, n_classes)


def student_quantile(freedom: Any) -> FloatArray:
    """Return the half-width, in standard errors, of Student's two-sided 95 % interval for these degrees of freedom."""
    special = importlib.import_module("scipy.special")
    return np.asarray(special.stdtrit(np.minimum(freedom, _MOST_FREEDOM), 0.5 + LEVEL / 2))


def two_sided_p(t: float, freedom: float) -> float:
    """Return the probability that Student's t, with `freedom` degrees of freedom, is at least as far from 0 as `t`."""
    special = importlib.import_module("scipy.special")
    return float(2 * special.stdtr(min(freedom, _MOST_FREEDOM), -abs(t)))


def influences(without: FloatArray, strata: IntArray) -> FloatArray:
    """Return (…, replicates) influences; their squares, summed over replicates, are a score's squared standard error.

    Parameters
    ----------
    without
        (…, replicates) scores computed without each replicate.
    strata
        (replicates,) stratum index of each replicate; at least two replicates in each stratum.

    Notes
    -----
    The jackknife of Quenouille and Tukey, within strata as in Shao and Tu 1995, The jackknife and bootstrap, section
    6.2. For a mean over replicates it equals the usual standard error, and no derivative of a metric is needed.
    """
    out = np.zeros_like(without)
    for one in np.unique(strata):
        mine = without[..., strata == one]
        n = mine.shape[-1]
        out[..., strata == one] = np.sqrt((n - 1) / n) * (mine.mean(axis=-1, keepdims=True) - mine)
    return out


@dataclass(frozen=True)
class ScoreTransform:
    """A monotone function of a score, on whose scale an interval is symmetric, and the inverse function."""

    name: str
    there: Callable[[Any], Any]
    back: Callable[[Any], Any]


def transform_of(metric: Metric, score: float, n: int) -> ScoreTransform:
    """Return the transform of a metric's score on whose scale Student's interval is symmetric.

    The upper end of an error is infinite beyond ten times its `score`; a share of `n` rows is limited to the range
    from 0.5/n to 1 - 0.5/n. A caller's own metric, whose range is unknown, is not transformed.

    Notes
    -----
    If a mean of squares over few sessions is too low, its interval is too narrow, and the reverse; the interval of the
    reciprocal does not have this fault. On the scale of log-odds, shares near 0 or 1 have room on both sides (Agresti
    2013, Categorical data analysis, section 3.1). ``benchmarks/coverage.py`` measures the coverage of both.
    """
    if metric.function is not None:
        return ScoreTransform("its own scale", np.asarray, np.asarray)
    if metric.name in ("rmse", "mae", "mean_euclidean_error"):
        least = max(score, np.finfo(np.float64).tiny ** 0.5) / 1e3
        return ScoreTransform(
            "reciprocal scale",
            lambda x: 1.0 / np.maximum(x, least),
            lambda x: 1.0 / x if x > 1.0 / (FURTHEST * max(score, least)) else np.inf,
        )
    if metric.name == "r2":
        return ScoreTransform(
            "scale of log(1 − R²)", lambda x: np.log(np.maximum(1.0 - x, 0.5 / n)), lambda x: 1.0 - np.exp(x)
        )
    edge = 0.5 / n

    def odds(x: Any) -> Any:
        inside = np.clip(x, edge, 1.0 - edge)
        return np.log(inside / (1.0 - inside))

    return ScoreTransform("scale of log-odds", odds, lambda x: 1.0 / (1.0 + np.exp(-x)))


def replicates(data: Dataset, name: str | None, tested: Answers) -> ReplicateUnits:
    """Return the replicate of each test row, by the group labels called `name`; None: all rows are one replicate."""
    if name is None:
        return ReplicateUnits("", np.zeros(len(tested), dtype=np.int64), ("",))
    values = at_rows(data, data.column(lambda table: table.groups[name]), tested)
    labels, codes = np.unique(values, return_inverse=True)
    return ReplicateUnits(name, codes.reshape(-1).astype(np.int64), tuple(labels.tolist()))


def summed(
    metric: Metric,
    tested: Answers,
    unit: ReplicateUnits,
    n_classes: int,
    held: FloatArray | None = None,
    truth: FloatArray | None = None,
) -> dict[str, Any]:
    """Return the sums that the module's docstring describes, for the replicates in `unit`.

    `held` has the (replicates, 2) sums over unloaded holds, and `truth` the (n,) true force [N], if these are known.
    """
    strata = unit.strata(tested.y_true, n_classes)
    kept = {"unit": unit.name, "names": list(unit.labels), "strata": strata.tolist() if strata.any() else None}
    if metric.function is not None:
        score = metric.of(tested.y_true, tested.y_pred)
        own, without = unit_scores(metric, tested.y_true, tested.y_pred, unit, n_classes)
        without = np.where(np.isfinite(without), without, score)
        carried = score + (len(own) - 1) * (without.mean() - without)
        return {**kept, "strata": None, "own": _plain(own), "scores": _plain(carried)}

    def against(y: npt.NDArray[Any]) -> dict[str, Any]:
        sums = unit.sums(metric.rows(y, tested.y_pred, n_classes))
        # Counts are written as whole numbers; all else keeps every digit.
        lines = [[int(one) if one.is_integer() else one for one in line] for line in sums.tolist()]
        if n_classes:
            lines = [[value for place in np.flatnonzero(line) for value in (int(place), line[place])] for line in lines]
        return {"sums": lines, "own": _plain(own_scores(metric, sums, n_classes))}

    return {
        **kept,
        **against(tested.y_true),
        **({} if held is None else {"floor": held.tolist()}),
        **({} if truth is None else {"true": against(truth)}),
    }


def _plain(scores: FloatArray) -> list[float | None]:
    return [float(one) if np.isfinite(one) else None for one in scores]


def tables_of(several: Sequence[dict[str, Any]], metric: str, n_classes: int) -> FloatArray:
    """Return the (rows, replicates, m) sums that :func:`summed` wrote, for rows with the same names of replicates.

    For the metric :data:`EXCESS`, squares and degrees of freedom of the unloaded holds follow those of the errors.
    """
    if not n_classes:
        dense = np.array([one["sums"] for one in several], dtype=np.float64)
        if metric != EXCESS.name:
            return dense
        return np.concatenate([dense[..., :2], np.array([one["floor"] for one in several], dtype=np.float64)], axis=2)
    lines = [line for one in several for line in one["sums"]]
    out = np.zeros((len(lines), n_classes * n_classes))
    for row, line in zip(out, lines, strict=True):
        row[line[::2]] = line[1::2]
    return out.reshape(len(several), -1, n_classes * n_classes)
