"""White noise of each channel, before rounding."""

from __future__ import annotations

from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Add it."""
    sd = signal.scene.environment.noise_scale * signal.each(lambda nuisances: nuisances.white.value)
    signal.readings = signal.readings + sd * signal.generator("white-noise", "recording").normal(
        size=signal.readings.shape
    )
