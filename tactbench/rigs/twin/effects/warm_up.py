"""Warm-up: all channels drift together towards the level of the warm sensor."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Subtract what is still to come of ``A (1 - exp(-t/tau))``, so that the stated rest is that of the warm sensor."""
    environment = signal.scene.environment
    since = environment.since_power_on.to("s") + signal.scene.starts_after_s + signal.t_s
    tau = signal.each(lambda nuisances: nuisances.warm_up_tau.to("s"))
    amplitude = environment.drift_scale * signal.each(lambda nuisances: nuisances.warm_up.value)
    scatter = signal.each(lambda nuisances: nuisances.warm_up_scatter.to("1"))
    factor = 1.0 + scatter * signal.generator("warm-up", "unit").normal(size=len(signal.channels))
    to_come = np.exp(-since[:, None] / np.where(tau > 0, tau, 1.0))
    signal.readings = signal.readings - amplitude * factor * to_come
