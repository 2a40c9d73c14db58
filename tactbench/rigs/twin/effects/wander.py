"""Wander: an Ornstein-Uhlenbeck process for each channel, exact for any step."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Add free drift, stationary from the first sample."""
    sd = signal.scene.environment.drift_scale * signal.each(lambda nuisances: nuisances.wander.value)
    tau = signal.each(lambda nuisances: nuisances.wander_tau.to("s"))
    generator = signal.generator("wander", "recording")
    for place in np.flatnonzero(sd > 0):
        drift = ornstein_uhlenbeck(signal.t_s, float(sd[place]), float(tau[place]), generator)
        signal.readings[:, place] += drift


def ornstein_uhlenbeck(t_s: FloatArray, sd: float, tau_s: float, generator: np.random.Generator) -> FloatArray:
    """Return (n,) of ``x' = a x + sd sqrt(1 - a²) n``, ``a = exp(-dt/tau)``: mean 0, variance ``sd²`` at every sample.

    A step of zero changes nothing.
    """
    from tactbench.rigs.twin.effects.creep import recursion

    dt = np.maximum(np.diff(t_s), 0.0)
    kicks = generator.normal(size=len(t_s))
    step = sd * np.sqrt(-np.expm1(-2.0 * dt / tau_s)) * kicks[1:]
    return recursion(np.exp(-dt / tau_s), step, sd * float(kicks[0]))
