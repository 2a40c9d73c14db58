"""Several tasks in one number: the interquartile mean of scores between the trivial answer and a declared reference."""

from __future__ import annotations

import hashlib
import importlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.core.evaluation.interval import student_quantile
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.evaluation.replicate_sums import tables_of
from tactbench.core.samples import FloatArray
from tactbench.core.statistics.influence import scores_of, together

Row = Mapping[str, Any]
RESAMPLES = 2000
SEED = 0x7AC7
TRIM = 0.25
"""Share cut off at either end."""


@dataclass(frozen=True)
class Aggregate:
    """An average over tasks; 0 is the trivial answer's, 1 the reference's. Below 0 is worse than trivial."""

    value: float
    low: float
    high: float
    """95 % interval over replicates; the tasks are those given, not a sample of all tasks"""
    tasks: int
    entries: int
    """(task, replicate) pairs that it is the mean of"""
    left_out: tuple[str, ...]
    """tasks that could not be put between 0 and 1, and why"""


def normalised(row: Row, score: Any) -> Any:
    """Return `score` between the row's trivial baseline, 0, and the task's reference, 1; nothing is clipped."""
    return (score - row["baseline"]) / (reference_of(row) - row["baseline"])


def reference_of(row: Row) -> float:
    """Return the score that counts as 1: the task's own reference, or the perfect answer of its metric."""
    declared = row.get("reference_score")
    if declared is not None:
        return float(declared)
    return 1.0 if METRICS[row["metric"]].higher_is_better else 0.0


def aggregate(rows: Sequence[Row]) -> Aggregate | None:
    """Return the interquartile mean over tasks and replicates; None if no task could be normalised.

    Parameters
    ----------
    rows
        Finished rows of one sensor or estimator, under one protocol. Several of one task share its weight.

    Notes
    -----
    After Agarwal et al. 2021, Deep reinforcement learning at the edge of the statistical precipice: the mean of the
    middle half of all (task, replicate) scores, with an interval from resampling replicates within each task. Tasks
    weigh the same, however many replicates they have. Where a replicate has no score of its own (classes live in
    replicates of their own), the task enters with its one score, which varies as the resampled replicates make it.
    """
    left_out = tuple(f"{row['task']}: {why}" for row in rows if (why := _why_not(row)))
    entered = [row for row in rows if not _why_not(row)]
    if not entered:
        return None
    tasks = [row["task"] for row in entered]
    own, sampled, replicates = zip(*map(_entries, entered), strict=True)
    values, drawn = ([normalised(row, one) for row, one in zip(entered, each, strict=True)] for each in (own, sampled))
    cells = Counter(tasks)
    weights = np.concatenate(
        [np.full(len(own), 1 / len(own) / cells[task]) for task, own in zip(tasks, values, strict=True)]
    )
    value = float(interquartile_mean(np.concatenate(values)[None, :], weights)[0])
    resampled = interquartile_mean(np.concatenate(drawn, axis=1), weights)
    resampled = resampled[np.isfinite(resampled)]
    tail = _widened_tail(min(replicates))
    low, high = np.quantile(resampled, [tail, 1 - tail])
    return Aggregate(value, float(low), float(high), len(cells), len(weights), left_out)


def _why_not(row: Row) -> str:
    if row["baseline"] is None:
        return "it has no trivial baseline here"
    if row["baseline"] == reference_of(row):
        return "the trivial answer is as good as the reference"
    if not together([row]):
        return "it has no replicates to resample"
    return ""


def _entries(row: Row) -> tuple[FloatArray, FloatArray, int]:
    """Return (k,) scores of a task, (RESAMPLES, k) what they might have been, and of how many replicates."""
    metric, n_classes, kept = METRICS[row["metric"]], len(row["classes"]), row["replicates"]
    group = together([row])[0]
    if "scores" in kept:
        own = scores_of(kept, row["metric"])
        return own, own[_drawn(group.names, len(own))], len(own)
    sums = tables_of([kept], row["metric"], n_classes)[0]
    sizes = np.unique(group.strata, return_counts=True)[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        own = metric.score(sums, n_classes)
        if kept["strata"] is None and np.isfinite(own).all():
            return own, own[_drawn(group.names, len(own))], len(own)
        times = np.zeros((RESAMPLES, len(sums)))
        for stratum in np.unique(group.strata):
            mine = np.flatnonzero(group.strata == stratum)
            places = mine[_drawn((*group.names, str(stratum)), len(mine))]
            np.add.at(times, (np.arange(RESAMPLES)[:, None], places), 1.0)
        whole = metric.score(times @ sums, n_classes)
    return np.array([row["score"]]), whole[:, None], int(sizes.min())


def _drawn(names: Sequence[str], n: int) -> Any:
    """Return (RESAMPLES, n) places drawn with replacement; the same for the same names."""
    digest = hashlib.blake2b("\n".join(names).encode(), digest_size=8).digest()
    rng = np.random.default_rng([SEED, int.from_bytes(digest, "little")])
    return rng.integers(0, n, size=(RESAMPLES, n))


def interquartile_mean(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return (n,) means of the middle half, by weight, of each line of `values`, (n, k); `weights` are (k,).

    An entry that the border cuts counts with the part of its weight that is inside, so that with equal weights this is
    the 25 % trimmed mean with fractional ends.
    """
    order = np.argsort(values, axis=1)
    sorted_values = np.take_along_axis(values, order, axis=1)
    share = weights[order] / weights.sum()
    end = np.cumsum(share, axis=1)
    inside = np.clip(np.minimum(end, 1 - TRIM) - np.maximum(end - share, TRIM), 0.0, None)
    return np.asarray((sorted_values * inside).sum(axis=1) / inside.sum(axis=1))


def _widened_tail(n: int) -> float:
    """Return the normal tail beyond ``sqrt(n / (n - 1)) t(n - 1)``, where n replicates are the fewest that are drawn.

    Percentiles of few resampled replicates cover less than they say: they are widened as Student's t would widen a
    normal interval (Hesterberg 2015, What teachers should know about the bootstrap, section 5.3).
    """
    special = importlib.import_module("scipy.special")
    return float(special.ndtr(-student_quantile(n - 1) * np.sqrt(n / (n - 1))))
