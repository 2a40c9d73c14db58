"""Offsets between recordings and sessions."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add what all channels of a recording share, what is each one's own, and what a new session changes."""
    environment = run.scene.environment
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is None:
                continue
            shared = nuisances.offset_shared.value * float(run.of_recording("offset", "shared", kind).standard_normal())
            own = run.of_every_channel(track, kind, run.of_recording("offset", "own", kind))
            session = run.of_every_channel(track, kind, run.of_session("offset", kind))
            track.readings[:, columns] += environment.scale_of_offsets * (shared + nuisances.offset_own.value * own)
            scale = environment.session_offset_scale * nuisances.offset_session.value
            track.readings[:, columns] += scale * session
