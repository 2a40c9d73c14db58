"""The unloaded hold at the start of a recording: which rows it has, and what the channels read there.

A scene states it (:class:`ForceRamp.hold`): no load for so long, before any press. Recordings without a scene, a clock
or a hold at zero force state none, and none is inferred from their readings.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import NotApplicable
from tactbench.core.samples import FloatArray
from tactbench.core.spec.recording import RecordingMeta

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset, Table


def hold_s(meta: RecordingMeta) -> float:
    """Return how many seconds a recording is commanded to be unloaded before its press; 0 where it states none."""
    if meta.scene is None or meta.clock == "none" or meta.scene.profile.start.to("N") != 0:
        return 0.0
    return meta.scene.profile.hold_s


def unloaded(table: Table) -> npt.NDArray[np.bool_]:
    """Return (n,) which rows of a recording lie in its unloaded hold."""
    return np.asarray(table.time_s < hold_s(table.meta))


def tared(table: Table) -> FloatArray:
    """Return (n, features) readings less their mean over the recording's own unloaded hold.

    Rows after the hold change nothing; a recording without a row there is returned as it is.
    """
    before = unloaded(table)
    return np.asarray(table.X - table.X[before].mean(axis=0)) if before.any() else table.X


def tare_s(data: Dataset) -> float:
    """Return how many seconds every recording can be tared on, the shortest hold of all; 0 if none states one.

    Raises
    ------
    NotApplicable
        If some recordings can be tared and others cannot: their readings would not be of one kind.
    """
    held = [hold_s(table.meta) if unloaded(table).any() else 0.0 for table in data.tables]
    if any(held) and not all(held):
        name = data.metas[held.index(0.0)].name
        raise NotApplicable(
            f"{sum(one > 0 for one in held)} of {len(held)} recordings state an unloaded hold to tare on; {name!r} "
            "states none.",
            hint="Use --protocol deployable-untared, which tares none of them.",
        )
    return min(held, default=0.0)
