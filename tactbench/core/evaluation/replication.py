"""What was repeated, and so what an interval may resample: sessions, groups, recordings; never samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.evaluation.dataset import Dataset
from tactbench.core.evaluation.interval import enough, plural
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
    caveat: str = ""
    """What an interval over them does not know; added to how it was found"""


def replicates(
    data: Dataset, task: TaskSpec, split: str, y: npt.NDArray[Any], recording: IntArray, row: IntArray
) -> ReplicateUnits:
    """Return the unit of replication of every test row.

    The coarsest unit of which there are enough to resample: the group that the split keeps apart, or else the session;
    then the groups that the task names; then the recording. If there are not enough of any, the first: the interval
    then resamples time and says so. Groups that some test row is not in cannot be resampled: that is said.

    Parameters
    ----------
    y, recording, row
        (n,) truth, recording and row in it of every test row.
    """
    first = "session" if split in SPLITS_WITHOUT_GROUPS or shots(split) else split
    named = [name for name in task.splits if name not in (*SPLITS_WITHOUT_GROUPS, first) and not shots(name)]
    names = list(dict.fromkeys([first, *named, "recording"]))
    units = [_unit(data, name, recording, row) for name in names]
    there = [one for one in units if one is not None]
    for place, one in enumerate(units):
        if one is not None and enough(y, one.codes, len(data.classes)):
            return replace(one, caveat=_caveat(names[:place], units[:place]))
    return there[0]


def _caveat(names: Sequence[str], units: Sequence[ReplicateUnits | None]) -> str:
    """Return what an interval does not know that passes over coarser units."""
    if not names:
        return ""
    unknown = [name for name, one in zip(names, units, strict=True) if one is None]
    why = f"; some test rows have no {' and no '.join(unknown)}" if unknown else ""
    return f": spread between {' and '.join(map(plural, names))} is not in it{why}"


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
