"""Gain scatter: channels of one unit answer with slightly different factors."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Draw one factor per channel, the same in every recording of a seed."""
    gain = np.ones(len(run.channels))
    for kind, columns in run.by_kind().items():
        nuisances = run.nuisances(kind)
        if nuisances is not None:
            numbers = run.of_every_channel(kind, run.of_unit("gain", kind))
            gain[columns] += nuisances.gain_scatter.to("1") * numbers
    run.gain = gain
