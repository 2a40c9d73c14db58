"""Noise of the force-torque sensor: the recorded force is the unfiltered one."""

from __future__ import annotations

from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Add white noise to the label."""
    sd = signal.scene.environment.force_noise.to("N")
    generator = signal.generator("force-noise", "recording")
    signal.label = signal.force + sd * generator.normal(size=len(signal.force))
