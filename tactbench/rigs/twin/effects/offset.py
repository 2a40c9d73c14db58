"""Offsets between recordings and sessions."""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import ChannelKind, FloatArray, SensorSpec
from tactbench.plugin.simulation import Nuisances
from tactbench.rigs.twin.synthesis import Synthesis, Track

_INDEPENDENT = 1e-9
"""Singular values below this share of the largest one are rounding: those columns repeat others."""


def apply(run: Synthesis) -> None:
    """Add what all channels of a recording share, what is each one's own, and what a new session changes."""
    environment = run.scene.environment
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is None:
                continue
            shared = nuisances.offset_shared.value * float(run.of_recording("offset", "shared", kind).standard_normal())
            own = nuisances.offset_own.value * _own(run, track, kind, nuisances)
            session = run.of_every_channel(track, kind, run.of_session("offset", kind))
            track.readings[:, columns] += environment.scale_of_offsets * (shared + own)
            scale = environment.session_offset_scale * nuisances.offset_session.value
            track.readings[:, columns] += scale * session


def _own(run: Synthesis, track: Track, kind: ChannelKind, nuisances: Nuisances) -> FloatArray:
    """Return (recorded channels,) the own offsets, their mean square over channels and recordings 1.

    Where the spec states a smooth share ``f`` of a field over ``n`` places: ``sqrt(1 - f) e + sqrt(f n / r) P g`` with
    white ``e`` and ``g`` and the projection P on the r-dimensional space of quadratics of mean 0 over the places, whose
    ``P g`` has the mean square r / n. No quadratic is preferred, whatever axes the places are written in.
    """
    alone = run.of_every_channel(track, kind, run.of_recording("offset", "own", kind))
    share = 0.0 if nuisances.offset_smooth is None else nuisances.offset_smooth.to("1")
    basis = smooth_basis(run.sensor.spec, kind) if share else None
    if basis is None or not basis.size:
        return alone
    channels, dimensions = basis.shape
    white = run.of_recording("offset", "smooth", kind).standard_normal(channels)
    field = math.sqrt(share * channels / dimensions) * (basis @ (basis.T @ white))
    names = [channel.name for channel in run.sensor.spec.channels(kind)]
    recorded = [names.index(channel.name) for channel in track.channels if channel.kind == kind]
    return np.asarray(math.sqrt(1.0 - share) * alone + field[recorded])


def smooth_basis(spec: SensorSpec, kind: ChannelKind) -> FloatArray | None:
    """Return (n, r) orthonormal columns: the quadratics over the n channels' places less their means, r at most 5.

    Places are (x, angle about x) on a sheet with a radius, else (x, y). None if a channel has no place.
    """
    places = [channel.position_m for channel in spec.channels(kind)]
    if not places or any(place is None for place in places):
        return None
    x, y, z = np.array(places, dtype=np.float64).T
    round_finger = spec.skin is not None and spec.skin.sheet.outer_radius is not None
    across = np.arctan2(y, -z) if round_finger else y
    u, v = (_scaled(one) for one in (x, across))
    columns = np.stack([u, v, u * u, u * v, v * v], axis=1)
    columns -= columns.mean(axis=0)
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, singular > _INDEPENDENT * max(float(singular[0]), 1.0)])


def _scaled(values: FloatArray) -> FloatArray:
    """Return values about 0 and within 1, so that squares of metres do not drown; all 0 where they are all alike."""
    about = values - (values.max() + values.min()) / 2
    return np.asarray(about / (np.abs(about).max() or 1.0))
