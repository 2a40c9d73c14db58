"""The converter: rounds to its step, clips to its range, flags what stood at the end."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import Quality
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Turn readings into what the converter would store; the last stage.

    A sample is flagged SATURATED when the converter stands at its end, as the reader of a real one would see it.
    """
    for track in run.tracks:
        for column, channel in enumerate(track.channels):
            nuisances = run.nuisances(channel.kind)
            reading = track.readings[:, column]
            if nuisances is not None and nuisances.step.value > 0:
                reading = np.round(reading / nuisances.step.value) * nuisances.step.value
            lower = -np.inf if channel.lower is None else channel.lower
            upper = np.inf if channel.upper is None else channel.upper
            reading = np.clip(reading, lower, upper)
            track.quality[(reading <= lower) | (reading >= upper), column] |= np.uint8(Quality.SATURATED)
            track.readings[:, column] = reading
