"""Gain scatter: channels of one unit answer with slightly different factors, and other units with others."""

from __future__ import annotations

import numpy as np

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Draw one factor per channel, the same in every recording of a unit, and one that a unit's channels share.

    The first unit's shared factor is 1: its gain is the one that the spec describes. A factor is never below zero.
    """
    for track in run.tracks:
        gain = np.ones(len(track.channels))
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is not None:
                numbers = run.of_every_channel(track, kind, run.of_unit("gain", kind))
                gain[columns] += nuisances.gain_scatter.to("1") * numbers
                if nuisances.unit_gain is not None and not run.scene.first_unit:
                    shared = float(run.of_unit("shared gain", kind).standard_normal())
                    stated = f"{nuisances.unit_gain.to('%'):g} % (sd, {nuisances.unit_gain.source.tag})"
                    run.drawn["remark unit gain"] = (
                        f"units beside 1 are drawn: gains of {kind} channels differ by {stated}"
                    )
                    gain[columns] *= max(1.0 + nuisances.unit_gain.to("1") * shared, 0.0)
        track.gain = gain
