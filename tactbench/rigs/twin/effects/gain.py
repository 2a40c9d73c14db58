"""Gain scatter: channels of one unit answer with slightly different factors."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Draw one factor per channel, the same in every recording of a seed."""
    for track in run.tracks:
        gain = np.ones(len(track.channels))
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is not None:
                numbers = run.of_every_channel(track, kind, run.of_unit("gain", kind))
                gain[columns] += nuisances.gain_scatter.to("1") * numbers
        track.gain = gain
