"""Which cell is best without each replicate in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tactbench.core.evaluation.metrics import SUMMED
from tactbench.core.evaluation.replicate_sums import tables_of
from tactbench.core.samples import FloatArray
from tactbench.core.statistics.influence import PairableRows, scores_of

Row = Mapping[str, Any]


def best_without(rows: Sequence[Row], groups: Sequence[PairableRows]) -> list[int] | None:
    """Return the place in `rows` of the best one without each replicate; None if they do not share replicates.

    Parameters
    ----------
    rows
        Finished rows of one metric.
    groups
        What :func:`together` says of them.

    Notes
    -----
    A first place that leaves with one replicate is no property of the sensor (Huang et al. 2025, Dropping just a
    handful of preferences can change top large language model rankings).
    """
    metric = str(rows[0]["metric"])
    if len(groups) != 1 or len(groups[0].places) != len(rows):
        return None
    kept = [row["replicates"] for row in rows]
    if all("scores" in one for one in kept):
        each = np.array([scores_of(one, metric) for one in kept])
        without = np.array([np.median(np.delete(each, place, axis=1), axis=1) for place in range(each.shape[1])]).T
    else:
        without = _scores_without(kept, metric, len(rows[0]["classes"]))
    best = np.argmax(without, axis=0) if SUMMED[metric].higher_is_better else np.argmin(without, axis=0)
    return [int(place) for place in best]


def _scores_without(kept: list[dict[str, Any]], metric: str, n_classes: int) -> FloatArray:
    sums = tables_of(kept, metric, n_classes)
    with np.errstate(divide="ignore", invalid="ignore"):
        return SUMMED[metric].score(sums.sum(axis=1, keepdims=True) - sums, n_classes)
