"""Offsets between recordings and sessions."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add what all channels of a recording share, what is each one's own, and what a new session changes."""
    environment = run.scene.environment
    for kind, columns in run.by_kind().items():
        nuisances = run.nuisances(kind)
        if nuisances is None:
            continue
        shared = nuisances.offset_shared.value * float(run.of_recording("offset", "shared", kind).standard_normal())
        own = nuisances.offset_own.value * run.of_every_channel(kind, run.of_recording("offset", "own", kind))
        session = nuisances.offset_session.value * run.of_every_channel(kind, run.of_session("offset", kind))
        run.readings[:, columns] += environment.drift_scale * (shared + own)
        run.readings[:, columns] += environment.session_offset_scale * session
