"""Rest level: what a channel reads with nothing touching."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Put the response on the stated rest levels, spread over the channels of this unit where the spec says so."""
    rest = np.array([channel.rest.value if channel.rest else 0.0 for channel in signal.channels])
    spread = signal.sensor.spec.parameters.get("rest_spread")
    if spread is not None:
        taxels = np.array([channel.kind == "taxel" for channel in signal.channels])
        own = signal.generator("rest-level", "unit").normal(size=len(signal.channels))
        rest = rest + np.where(taxels, spread.value * own, 0.0)
    signal.readings = rest + signal.response
