"""Effects applied to the readings before they are stored: gain, levels, drift, noise, converter, force sensor."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from tactbench.plugin import ChannelKind, FloatArray, Quality, RigError, SensorSpec
from tactbench.plugin.simulation import Nuisances
from tactbench.rigs.twin.effects.memory import lag, recurrence, time_constant_s, wandering
from tactbench.rigs.twin.synthesis import Synthesis, Track

_INDEPENDENT = 1e-9
"""Share of the largest singular value below which a singular value is rounding error: its column depends on others."""


def _stated(run: Synthesis) -> Iterator[tuple[Track, ChannelKind, list[int], Nuisances]]:
    """Yield stream, kind, columns and nuisances of each kind of channels for which the spec states nuisances."""
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is not None:
                yield track, kind, columns, nuisances


def gain(run: Synthesis) -> None:
    """Draw one gain factor per channel, the same in every recording of a unit, and one for all channels of a unit.

    The first unit's common factor is 1: its gain is the one in the spec. A factor is never below zero.
    """
    for track in run.tracks:
        track.gain = np.ones(len(track.channels))
    for track, kind, columns, nuisances in _stated(run):
        assert track.gain is not None
        numbers = run.of_every_channel(track, kind, run.of_unit("gain", kind))
        track.gain[columns] += nuisances.gain_scatter.to("1") * numbers
        if nuisances.unit_gain is not None and not run.scene.first_unit:
            shared = run.of_unit("shared gain", kind).standard_normal()
            stated = f"{nuisances.unit_gain.to('%'):g} % (sd, {nuisances.unit_gain.source.tag})"
            run.drawn["remark unit gain"] = f"units beside 1 are drawn: gains of {kind} channels differ by {stated}"
            track.gain[columns] *= max(1.0 + nuisances.unit_gain.to("1") * shared, 0.0)


def rest_spread(run: Synthesis) -> None:
    """Move each taxel's rest level by a random number, the same in every recording; sd: parameter ``rest_spread``."""
    stated = run.sensor.spec.parameters.get("rest_spread")
    if stated is None:
        return
    for track in run.tracks:
        columns = track.by_kind().get("taxel", [])
        numbers = run.of_every_channel(track, "taxel", run.of_unit("rest", "taxel"))
        track.readings[:, columns] += stated.value * numbers


def unit_rest(run: Synthesis) -> None:
    """Move rest levels by a random number per unit and one per channel; the first unit keeps the spec's levels."""
    if run.scene.first_unit:
        return
    for track, kind, columns, nuisances in _stated(run):
        shared = run.of_unit("shared rest", kind).standard_normal()
        own = run.of_every_channel(track, kind, run.of_unit("own rest", kind))
        stated = []
        for spread, of_what, numbers in (
            (nuisances.unit_rest_shared, "together", shared),
            (nuisances.unit_rest_own, "each", own),
        ):
            if spread is not None:
                track.readings[:, columns] += spread.value * numbers
                stated.append(f"{spread} {of_what} ({spread.source.tag})")
        if stated:
            run.drawn["remark unit rest"] = (
                f"units beside 1 are drawn: rest levels of {kind} channels differ by {' and '.join(stated)}, sd"
            )


def offset(run: Synthesis) -> None:
    """Add random offsets: one common to all channels of a recording, one of each channel, and those of a session."""
    environment = run.scene.environment
    for track, kind, columns, nuisances in _stated(run):
        shared = nuisances.offset_shared.value * run.of_recording("offset", "shared", kind).standard_normal()
        own = nuisances.offset_own.value * _own_offsets(run, track, kind, nuisances)
        session = run.of_every_channel(track, kind, run.of_session("offset", kind))
        track.readings[:, columns] += environment.scale_of_offsets * (shared + own)
        scale = environment.session_offset_scale * nuisances.offset_session.value
        track.readings[:, columns] += scale * session


def _own_offsets(run: Synthesis, track: Track, kind: ChannelKind, nuisances: Nuisances) -> FloatArray:
    """Return the (recorded channels,) offsets of single channels, of mean square 1 over channels and recordings.

    If the spec states a share ``f`` that varies smoothly over the ``n`` places: ``sqrt(1 - f) e + sqrt(f n / r) P g``,
    with white ``e`` and ``g`` and the projection P on the r-dimensional space of quadratics of mean 0 over the places;
    ``P g`` has the mean square r / n. The result does not depend on the axes in which the places are given.
    """
    white = run.of_every_channel(track, kind, run.of_recording("offset", "own", kind))
    share = 0.0 if nuisances.offset_smooth is None else nuisances.offset_smooth.to("1")
    basis = smooth_basis(run.sensor.spec, kind) if share else None
    if basis is None or not basis.size:
        return white
    channels, dimensions = basis.shape
    smooth = run.of_recording("offset", "smooth", kind).standard_normal(channels)
    field = math.sqrt(share * channels / dimensions) * (basis @ (basis.T @ smooth))
    names = [channel.name for channel in run.sensor.spec.channels(kind)]
    recorded = [names.index(channel.name) for channel in track.channels if channel.kind == kind]
    return math.sqrt(1.0 - share) * white + field[recorded]


def smooth_basis(spec: SensorSpec, kind: ChannelKind) -> FloatArray | None:
    """Return (n, r) orthonormal columns that span the quadratics of mean 0 over the n channels' places; r is at most 5.

    Places are (x, angle about x) on a sheet with a radius, else (x, y). None if a channel has no place.
    """
    places = [channel.position_m for channel in spec.channels(kind)]
    if not places or any(place is None for place in places):
        return None
    x, y, z = np.array(places, dtype=np.float64).T
    round_finger = spec.skin is not None and spec.skin.sheet.outer_radius is not None
    across = np.arctan2(y, -z) if round_finger else y
    # Within -1 to 1, so that squares of metres are not lost; 0 if all are equal.
    u, v = (one - (one.max() + one.min()) / 2 for one in (x, across))
    u, v = (one / (np.abs(one).max() or 1.0) for one in (u, v))
    columns = np.stack([u, v, u * u, u * v, v * v], axis=1)
    columns -= columns.mean(axis=0)
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, singular > _INDEPENDENT * max(float(singular[0]), 1.0)]


def warm_up(run: Synthesis) -> None:
    """Add ``-W f_i exp(-t / tau)`` to the spec's rest levels, which are those of the warm sensor.

    ``t`` counts from power-on; the factors ``f_i = 1 + scatter n_i`` belong to the unit.
    """
    environment, scene = run.scene.environment, run.scene
    before = environment.since_power_on.to("s") + scene.starts_after_s
    for track, kind, columns, nuisances in _stated(run):
        if not nuisances.warm_up.value:
            continue
        numbers = run.of_every_channel(track, kind, run.of_unit("warm-up", kind))
        factors = 1.0 + nuisances.warm_up_scatter.to("1") * numbers
        still_to_come = nuisances.warm_up.value * np.exp(-(before + track.t_s) / nuisances.warm_up_tau.to("s"))
        track.readings[:, columns] -= environment.drift_scale * still_to_come[:, None] * factors


def wander(run: Synthesis) -> None:
    """Add a slow random drift: one independent Ornstein-Uhlenbeck path per channel."""
    scale = run.scene.environment.drift_scale
    for track, kind, columns, nuisances in _stated(run):
        if nuisances.wander.value:
            tau_s, draws = nuisances.wander_tau.to("s"), run.of_recording("wander", kind, *track.scope)
            track.readings[:, columns] += wandering(
                track.t_s, scale * nuisances.wander.value, tau_s, len(columns), draws
            )


def white_noise(run: Synthesis) -> None:
    """Add independent normal numbers to every sample, before the converter rounds."""
    scale = run.scene.environment.noise_scale
    for track, kind, columns, nuisances in _stated(run):
        if nuisances.white.value:
            noise = run.of_recording("white", kind, *track.scope).standard_normal((track.t_s.size, len(columns)))
            noise *= scale * nuisances.white.value
            track.readings[:, columns] += noise


def hum(run: Synthesis) -> None:
    """Add noise of the rms ``hum`` (counts) between ``hum_low`` and ``hum_high`` to channels of dynamic pressure."""
    stated = run.sensor.spec.parameters
    if "hum" not in stated:
        return
    size = run.scene.environment.noise_scale * stated["hum"].value
    low_hz, high_hz = stated["hum_low"].to("Hz"), stated["hum_high"].to("Hz")
    for track, column in run.columns("ac_pressure"):
        draws = run.of_recording("hum", track.channels[column].name)
        track.readings[:, column] += band_noise(track.t_s, size, low_hz, high_hz, draws)


def band_noise(
    t_s: FloatArray, spread: float, low_hz: float, high_hz: float, generator: np.random.Generator
) -> FloatArray:
    """Return (n,) Gaussian noise within a band, stationary from the first sample on, exact for any step.

    White noise through a first-order high-pass and a first-order low-pass, scaled to the standard deviation `spread`.
    The spectral density is ``f^2/((f^2 + l^2)(f^2 + h^2))`` up to a factor, with the corners ``l h = low high`` and
    ``l + h = high - low``, so that it falls to half of its peak at `low_hz` and at `high_hz`.

    Raises
    ------
    RigError
        If ``high/low`` is below ``3 + 2 sqrt(2)``: first-order filters cannot have a narrower band.

    Notes
    -----
    The filter ``s/((s + p)(s + r))`` is the difference of two Ornstein-Uhlenbeck paths with rates p < r that one white
    noise drives: ``(r e_r - p e_p)/(r - p)``. Their increments over a step are normal with covariances
    ``(1 - a_i a_j)/(p_i + p_j)``, drawn by Cholesky's factor.
    """
    apart = (high_hz - low_hz) ** 2 - 4.0 * low_hz * high_hz
    if not (0 < low_hz < high_hz and apart > 0):
        raise RigError(
            f"A hum between {low_hz:g} and {high_hz:g} Hz cannot be simulated: the band is too narrow or not positive.",
            hint="Make hum_high at least 5.9 times hum_low, and both above 0.",
        )
    rates = math.pi * np.array([high_hz - low_hz - math.sqrt(apart), high_hz - low_hz + math.sqrt(apart)])
    weights = np.array([-rates[0], rates[1]]) / (rates[1] - rates[0])
    sums = rates[:, None] + rates[None, :]
    weights = weights / math.sqrt(float(weights @ (1.0 / sums) @ weights))
    dt = np.diff(t_s, prepend=t_s[:1])
    faded = np.exp(-dt[:, None] * rates)
    fresh = -np.expm1(-dt[:, None, None] * sums) / sums
    fresh[0] = 1.0 / sums
    first = np.sqrt(fresh[:, 0, 0])
    across = np.divide(fresh[:, 0, 1], first, out=np.zeros_like(first), where=first > 0)
    second = np.sqrt(np.maximum(fresh[:, 1, 1] - across**2, 0.0))
    numbers = generator.standard_normal((t_s.size, 2))
    paths = (first * numbers[:, 0], across * numbers[:, 0] + second * numbers[:, 1])
    return np.asarray(
        spread * sum(w * recurrence(faded[:, n], path) for n, (w, path) in enumerate(zip(weights, paths, strict=True)))
    )


def converter(run: Synthesis) -> None:
    """Round readings to the converter's step and clip them to each channel's range; the last stage.

    A sample at either end of the converter's range is flagged SATURATED, as for a real sensor.
    """
    for track in run.tracks:
        for column, channel in enumerate(track.channels):
            nuisances = run.nuisances(channel.kind)
            reading, step = track.readings[:, column], 0.0 if nuisances is None else nuisances.step.value
            if step > 0:
                reading = np.round(reading / step) * step
            lower = -np.inf if channel.lower is None else channel.lower
            upper = np.inf if channel.upper is None else channel.upper
            reading = np.clip(reading, lower, upper)
            track.quality[(reading <= lower) | (reading >= upper), column] |= np.uint8(Quality.SATURATED)
            track.readings[:, column] = reading


def force_noise(run: Synthesis) -> None:
    """Add white noise to the reference force, unfiltered as in the paper; the load itself stays the true one.

    Tangential components come from the same sensor and get noise of the same size, drawn independently.
    """
    spread = run.scene.environment.force_noise.to("N")
    _change_forces(
        run, lambda true, *name: true + spread * run.of_recording("force", *name).standard_normal(run.t_s.size)
    )


def force_filter(run: Synthesis) -> None:
    """Filter the reference force, noise included, by a first-order low-pass at the scene's ``force_filter``.

    The filter is exact for a force linear between samples, for any steps, and starts in equilibrium.
    Tangential components pass the same filter.
    """
    cutoff = run.scene.environment.force_filter
    if cutoff is None:
        return
    tau_s = time_constant_s(cutoff.to("Hz"))
    _change_forces(run, lambda read, *_: lag(run.t_s, read, tau_s))


def _change_forces(run: Synthesis, change: Callable[..., FloatArray]) -> None:
    """Replace the (n,) readings of each force by what `change` makes of them, and of the name of a tangential force."""
    run.reference_n = change(run.reference_n)
    for name, (channel, read) in run.reference_more.items():
        if channel.kind == "force":
            run.reference_more[name] = (channel, change(read, name))
