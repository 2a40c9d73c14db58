"""Sums over each replicate (such as a session) that a result keeps, to compare scores later without the answers.

::

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

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset, at_rows
from tactbench.core.evaluation.interval import ReplicateUnits, own_scores, unit_scores
from tactbench.core.evaluation.metrics import EXCESS, Metric
from tactbench.core.evaluation.reference_floor import Floor
from tactbench.core.samples import Answers, FloatArray


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
    floor: Floor | None = None,
    truth: FloatArray | None = None,
) -> dict[str, Any]:
    """Return the sums described above, for the replicates in `unit`; `truth` is the (n,) true force [N], if known."""
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
        **({} if floor is None else {"floor": floor.by_replicate(tested, unit.codes).tolist()}),
        **({} if truth is None else {"true": against(truth)}),
    }


def _plain(scores: FloatArray) -> list[float | None]:
    return [float(one) if np.isfinite(one) else None for one in scores]


def tables_of(several: Sequence[dict[str, Any]], metric: str, n_classes: int) -> FloatArray:
    """Return the (rows, replicates, m) sums that :func:`summed` wrote, for rows with the same names of replicates.

    With the name of :data:`EXCESS`, squares and degrees of freedom of the unloaded holds follow those of the errors.
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
