"""Free drift of single channels."""

from __future__ import annotations

from tactbench.rigs.twin.effects.memory import wandering
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add one independent Ornstein-Uhlenbeck path per channel."""
    scale = run.scene.environment.drift_scale
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is None or not nuisances.wander.value:
                continue
            track.readings[:, columns] += wandering(
                track.t_s,
                scale * nuisances.wander.value,
                nuisances.wander_tau.to("s"),
                len(columns),
                run.of_recording("wander", kind, *track.scope),
            )
