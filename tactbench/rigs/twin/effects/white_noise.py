"""White noise of every sample, before the converter rounds."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add independent normal numbers."""
    scale = run.scene.environment.noise_scale
    for kind, columns in run.by_kind().items():
        nuisances = run.nuisances(kind)
        if nuisances is None or not nuisances.white.value:
            continue
        noise = run.of_recording("white", kind).standard_normal((run.t_s.size, len(columns)))
        noise *= scale * nuisances.white.value
        run.readings[:, columns] += noise
