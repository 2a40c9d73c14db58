"""White noise of every sample, before the converter rounds."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add independent normal numbers."""
    scale = run.scene.environment.noise_scale
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is None or not nuisances.white.value:
                continue
            generator = run.of_recording("white", kind, *track.scope)
            noise = generator.standard_normal((track.t_s.size, len(columns)))
            noise *= scale * nuisances.white.value
            track.readings[:, columns] += noise
