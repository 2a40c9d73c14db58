"""The shared warm-up of a heated sensor."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add ``-W f_i exp(-t / tau)``: the spec's rest is the warm level, less what is still to come.

    ``t`` counts from power-on; the factors ``f_i = 1 + scatter n_i`` belong to the unit.
    """
    environment, scene = run.scene.environment, run.scene
    before = environment.since_power_on.to("s") + scene.starts_after_s
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is None or not nuisances.warm_up.value:
                continue
            numbers = run.of_every_channel(track, kind, run.of_unit("warm-up", kind))
            factors = 1.0 + nuisances.warm_up_scatter.to("1") * numbers
            still_to_come = nuisances.warm_up.value * np.exp(-(before + track.t_s) / nuisances.warm_up_tau.to("s"))
            track.readings[:, columns] -= environment.drift_scale * still_to_come[:, None] * factors
