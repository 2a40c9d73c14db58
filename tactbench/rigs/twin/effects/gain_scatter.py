"""Gains: channels of one unit answer a little differently, the same in all its recordings."""

from __future__ import annotations

from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Multiply each channel's response by its own gain."""
    scatter = signal.each(lambda nuisances: nuisances.gain_scatter.to("1"))
    gain = 1.0 + scatter * signal.generator("gain-scatter", "unit").normal(size=len(signal.channels))
    signal.response = signal.response * gain
