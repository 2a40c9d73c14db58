"""The converter: rounds, then clips, then says where it stood at its end. Always the last stage."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import Quality
from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Turn readings into samples."""
    step = signal.each(lambda nuisances: nuisances.step.value)
    fine = np.where(step > 0, step, 1.0)
    rounded = np.where(step > 0, np.round(signal.readings / fine) * fine, signal.readings)
    lower = np.array([-np.inf if channel.lower is None else channel.lower for channel in signal.channels])
    upper = np.array([np.inf if channel.upper is None else channel.upper for channel in signal.channels])
    signal.samples = np.clip(rounded, lower, upper)
    saturated = (rounded < lower) | (rounded > upper)
    signal.quality = np.where(saturated, Quality.SATURATED, Quality.GOOD).astype(np.uint8)
