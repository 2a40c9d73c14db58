"""What a row keeps of its replicates, so that scores can be compared later without the answers.

::

    {"unit": "session",                  what a replicate is
     "names": ["s1", "s2", …],           in order of the names: two rows with the same names can be paired
     "strata": [0, 0, 1, …] or None,     which replicates may stand in for each other; None: all
     "run": 1,                           how many neighbouring blocks of time depend on each other
     "sums": [[…], …]                    the metric's summands over each replicate
     "floor": [[…, …], …]}               of a RMSE whose reference has a floor: squares and degrees of freedom of its
                                         unloaded holds over each replicate

A classification's summands are a table of true and given classes, mostly empty: a line of sums then is ``column, count,
column, count …``. Scores follow exactly: :attr:`Metric.score` of the sum of all lines is the row's score.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from tactbench.core.errors import UnknownNameError
from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.interval import block_length, enough, loss_of, strata_of
from tactbench.core.evaluation.metrics import EXCESS, SUMMED, Metric
from tactbench.core.evaluation.reference_floor import Floor, floor_sums
from tactbench.core.evaluation.replication import ReplicateUnits
from tactbench.core.samples import Answers, FloatArray, IntArray

BLOCKS = 40
"""Blocks of time a recording is cut into where there is nothing else to resample: the same share of time is the same
block for every sensor."""
BLOCKS_IN_ALL = 200
"""About so many, whatever the number of recordings; never fewer than `FEWEST` each."""
FEWEST = 4


def summed(
    metric: Metric, tested: Answers, unit: ReplicateUnits, data: Dataset, floor: Floor | None = None
) -> dict[str, Any]:  # fmt: skip
    """Return what a row keeps of its replicates.

    Parameters
    ----------
    tested
        The test rows, in time order within each recording of a fold.
    unit
        What was repeated. Where there are too few of them, the replicates are blocks of time within recordings, and
        the spread between sessions is not in them.
    floor
        What the holds of the tested recordings say of the reference.
    """
    n_classes = len(data.classes)
    summands = metric.rows(tested.y_true, tested.y_pred, n_classes)
    if enough(tested.y_true, unit.codes, n_classes):
        strata = strata_of(tested.y_true, unit.codes, n_classes)
        number = np.zeros(len(unit.labels), dtype=np.int64)
        for place, one in enumerate(strata):
            number[one] = place
        return {
            "unit": unit.name,
            "names": list(unit.labels),
            "strata": number.tolist() if len(strata) > 1 else None,
            "run": 1,
            "sums": _lines(summands, unit.codes, len(unit.labels), n_classes),
            **_floor(floor, tested, unit.codes, len(unit.labels)),
        }
    return summed_in_time(metric, tested, _recording_names(data), n_classes, floor)


def _floor(floor: Floor | None, tested: Answers, code: IntArray, n: int) -> dict[str, Any]:
    return {} if floor is None else {"floor": floor_sums(floor, tested.recording, code, n, tested.row).tolist()}


def summed_in_time(
    metric: Metric, tested: Answers, names: Sequence[str], n_classes: int, floor: Floor | None = None
) -> dict[str, Any]:  # fmt: skip
    """Return what a row keeps where time is all there is to resample: sums over blocks of each recording.

    Parameters
    ----------
    names
        What each recording is called, by its number.
    """
    summands = metric.rows(tested.y_true, tested.y_pred, n_classes)
    order = sorted(np.unique(tested.recording).tolist(), key=lambda place: names[place])
    most = int(np.clip(BLOCKS_IN_ALL // len(order), FEWEST, BLOCKS))
    code = np.zeros(len(tested), dtype=np.int64)
    labels: list[str] = []
    strata: list[int] = []
    lengths: list[int] = []
    runs: list[int] = []
    for stratum, place in enumerate(order):
        mine = np.flatnonzero(tested.recording == place)
        mine = mine[np.argsort(tested.row[mine], kind="stable")]
        blocks = min(most, len(mine))
        code[mine] = len(labels) + np.arange(len(mine)) * blocks // len(mine)
        labels += [f"{names[place]}/{number + 1}" for number in range(blocks)]
        strata += [stratum] * blocks
        lengths.append(len(mine) // blocks)
        correlated = block_length(loss_of(metric, tested.y_true[mine], tested.y_pred[mine]))
        runs.append(_run(correlated * blocks / len(mine), blocks))
    spread = f"{min(lengths)}" if min(lengths) == max(lengths) else f"{min(lengths)}–{max(lengths)}"
    return {
        "unit": f"block of {spread} rows in time",
        "names": labels,
        "strata": strata,
        "run": max(runs),
        "sums": _lines(summands, code, len(labels), n_classes),
        **_floor(floor, tested, code, len(labels)),
    }


def _run(blocks_correlated: float, blocks: int) -> int:
    """Return how many neighbouring blocks to take together, a power of two, of which a recording has four or more."""
    length = 1 << max(0, int(np.ceil(np.log2(max(blocks_correlated, 1.0)))))
    most = 1 << max(0, int(np.floor(np.log2(max(blocks // FEWEST, 1)))))
    return min(length, most)


def _recording_names(data: Dataset) -> list[str]:
    """Return a name for each recording, that of its session before it where two are called alike."""
    plain = [meta.name for meta in data.metas]
    many = Counter(plain)
    longer = [f"{meta.session}/{meta.name}" if many[meta.name] > 1 else meta.name for meta in data.metas]
    still = Counter(longer)
    return [f"{name} #{place + 1}" if still[name] > 1 else name for place, name in enumerate(longer)]


def _lines(summands: FloatArray, code: IntArray, n: int, n_classes: int) -> list[list[float]]:
    sums = np.zeros((n, summands.shape[1]))
    np.add.at(sums, code, summands)
    if not n_classes:
        return [_without_needless_points(line) for line in sums.tolist()]
    return [[int(value) for column in np.flatnonzero(line) for value in (column, line[column])] for line in sums]


def _without_needless_points(line: list[float]) -> list[float]:
    """Return counts as whole numbers; all else keeps every digit."""
    return [int(value) if value.is_integer() and abs(value) < 2**53 else value for value in line]


def tables_of(several: list[dict[str, Any]], metric: str, n_classes: int) -> FloatArray:
    """Return (rows, replicates, m) the sums that :func:`summed` wrote, of rows with equal names.

    Raises
    ------
    UnknownNameError
        If there is no such metric.
    ValueError
        If the sums of some row have another shape than its metric's.
    KeyError
        If the mean square beyond the floor is asked for, and a row keeps no floor.
    """
    if metric not in SUMMED:
        raise UnknownNameError("metric", metric, SUMMED)
    found = SUMMED[metric]
    if found.kind == "regression":
        dense = np.array([one["sums"] for one in several], dtype=np.float64)
        if dense.ndim != 3:
            raise ValueError(f"sums of shape {dense.shape} are not (rows, replicates, summands)")
        if found is EXCESS:
            held = np.array([one["floor"] for one in several], dtype=np.float64)
            return np.concatenate([dense[..., :2], held], axis=2)
        return dense
    replicates, columns = len(several[0]["names"]), n_classes * n_classes
    lines = [line for one in several for line in one["sums"]]
    pairs = np.array([value for line in lines for value in line], dtype=np.float64).reshape(-1, 2)
    column = pairs[:, 0].astype(np.int64)
    if len(lines) != len(several) * replicates or ((column < 0) | (column >= columns)).any():
        raise ValueError(f"sums are not of {replicates} replicates and {n_classes} classes")
    out = np.zeros((len(lines), columns))
    out[np.repeat(np.arange(len(lines)), [len(line) // 2 for line in lines]), column] = pairs[:, 1]
    return out.reshape(len(several), replicates, columns)
