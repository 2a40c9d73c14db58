"""What was repeated, and so what an interval may resample: sessions, groups, recordings; never samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.interval import enough
from tactbench.core.evaluation.splits import SPLITS_WITHOUT_GROUPS, shots
from tactbench.core.samples import IntArray
from tactbench.core.spec.task import TaskSpec


@dataclass(frozen=True)
class ReplicateUnits:
    """What was repeated: sessions, groups or recordings."""

    name: str
    """What one of them is called: session, object …"""
    codes: IntArray
    """(n,) which one each row belongs to"""
    labels: tuple[str, ...]
    """What each is called, by its code"""


def replicates(
    data: Dataset, task: TaskSpec, split: str, y: npt.NDArray[Any], recording: IntArray, row: IntArray
) -> ReplicateUnits:
    """Return the unit of replication of every test row.

    The coarsest unit of which there are enough to resample: the group that the split keeps apart, or else the session;
    then the groups that the task names; then the recording. If there are not enough of any, the first: the interval
    then resamples time and says so.

    Parameters
    ----------
    y, recording, row
        (n,) truth, recording and row in it of every test row.
    """
    first = "session" if split in SPLITS_WITHOUT_GROUPS or shots(split) else split
    named = [name for name in task.splits if name not in (*SPLITS_WITHOUT_GROUPS, first) and not shots(name)]
    units = [_unit(data, name, recording, row) for name in dict.fromkeys([first, *named, "recording"])]
    there = [one for one in units if one is not None]
    for one in there:
        if enough(y, one.codes, len(data.classes)):
            return one
    return there[0]


def _unit(data: Dataset, name: str, recording: IntArray, row: IntArray) -> ReplicateUnits | None:
    """Return the groups of one name; None if some test row is in none."""
    values = np.empty(len(recording), dtype=object)
    for place in np.unique(recording):
        table = data.tables[place]
        if name not in table.groups:
            return None
        mine = recording == place
        values[mine] = table.groups[name][np.searchsorted(table.row, row[mine])]
    labels, codes = np.unique(values.astype(np.str_), return_inverse=True)
    return ReplicateUnits(name, codes.reshape(-1).astype(np.int64), tuple(labels.tolist()))
