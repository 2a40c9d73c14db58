"""Creep: part of the response follows the load late."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Replace the force that each kind of channel follows by ``F (1 - sum c_i) + sum c_i lag_i(F)``.

    Linear viscoelasticity acts on the force before the load table is asked: loops follow from the force's history.
    """
    for track in run.tracks:
        for kind in track.by_kind():
            nuisances = run.nuisances(kind)
            if nuisances is None or not nuisances.creep:
                continue
            fractions = [term.fraction.to("1") for term in nuisances.creep]
            effective = (1.0 - sum(fractions)) * track.force_n
            for fraction, term in zip(fractions, nuisances.creep, strict=True):
                effective = effective + fraction * lag(track.t_s, track.force_n, term.tau.to("s"))
            # A weighted mean of forces that were: rounding must not leave the table's range.
            track.effective_n[kind] = np.clip(effective, track.force_n.min(), track.force_n.max())
