"""What was repeated, and so what an interval may resample: sessions, groups, recordings; never samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.interval import enough
from tactbench.core.evaluation.splits import SPLITS_WITHOUT_GROUPS, shots
from tactbench.core.samples import IntArray
from tactbench.core.spec.task import TaskSpec


def replicates(
    data: Dataset, task: TaskSpec, split: str, y: npt.NDArray[Any], recording: IntArray, row: IntArray
) -> tuple[IntArray, str]:
    """Return (n,) the unit of replication of every test row, and what such a unit is called.

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
    units = [(_unit(data, name, recording, row), name) for name in dict.fromkeys([first, *named, "recording"])]
    there = [(codes, name) for codes, name in units if codes is not None]
    for codes, name in there:
        if enough(y, codes, len(data.classes)):
            return codes, name
    return there[0]


def _unit(data: Dataset, name: str, recording: IntArray, row: IntArray) -> IntArray | None:
    """Return (n,) numbers of a group; None if some test row has none."""
    values = np.empty(len(recording), dtype=object)
    for place in np.unique(recording):
        table = data.tables[place]
        if name not in table.groups:
            return None
        mine = recording == place
        values[mine] = table.groups[name][np.searchsorted(table.row, row[mine])]
    return np.unique(values.astype(np.str_), return_inverse=True)[1].reshape(-1).astype(np.int64)
