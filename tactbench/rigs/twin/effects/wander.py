"""Free drift of single channels."""

from __future__ import annotations

from tactbench.rigs.twin.effects.memory import wandering
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add one independent Ornstein-Uhlenbeck path per channel."""
    scale = run.scene.environment.drift_scale
    for kind, columns in run.by_kind().items():
        nuisances = run.nuisances(kind)
        if nuisances is None or not nuisances.wander.value:
            continue
        run.readings[:, columns] += wandering(
            run.t_s,
            scale * nuisances.wander.value,
            nuisances.wander_tau.to("s"),
            len(columns),
            run.of_recording("wander", kind),
        )
