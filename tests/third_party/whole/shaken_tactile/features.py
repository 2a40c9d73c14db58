"""Features of a recording: how far each channel's largest excursion lies beyond its deviation."""

import numpy as np

from tactbench.plugin import StreamReadings


def crest_factors(streams: tuple[StreamReadings, ...]) -> dict[str, float]:
    """Return the crest factor of every channel of every stream; 0 of one that never changes."""
    found = {}
    for stream in streams:
        away = np.abs(stream.data - stream.data.mean(axis=0))
        deviation = stream.data.std(axis=0)
        factors = np.where(deviation > 0, away.max(axis=0) / np.where(deviation > 0, deviation, 1.0), 0.0)
        found |= {f"{name} crest factor": float(one) for name, one in zip(stream.channels, factors, strict=True)}
    return found
