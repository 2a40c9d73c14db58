"""Offsets: levels that differ from recording to recording, and from session to session."""

from __future__ import annotations

from tactbench.rigs.twin.effects.signal import Signal


def apply(signal: Signal) -> None:
    """Add this recording's shared and own offsets, and this session's."""
    environment = signal.scene.environment
    n = len(signal.channels)
    here = signal.generator("offset", "recording")
    shared = signal.each(lambda nuisances: nuisances.offset_shared.value) * here.normal()
    own = signal.each(lambda nuisances: nuisances.offset_own.value) * here.normal(size=n)
    session = signal.each(lambda nuisances: nuisances.offset_session.value)
    between = session * signal.generator("offset", "session").normal(size=n)
    signal.readings = (
        signal.readings + environment.drift_scale * (shared + own) + environment.session_offset_scale * between
    )
