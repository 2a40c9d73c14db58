"""Creep of the skin: a part of each channel's response follows the load with a delay."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import ChannelKind, FloatArray
from tactbench.plugin.simulation import Nuisances
from tactbench.rigs.twin.contact.stages import READ_FROM_THE_SKIN, read_names, skin_under_load
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.synthesis import Load, Settled, Synthesis


def apply(run: Synthesis) -> None:
    """Replace the force that each kind of channel follows by ``F (1 - sum c_i) + sum c_i lag_i(F)``.

    Linear viscoelasticity acts on the force before the load table is evaluated, which gives hysteresis. Creep
    is left out, and the plan is updated, where it changes no reading by more than a third of noise and rounding
    (:func:`bounds`), unless the scene includes it by name, has a motor's force loop, or heats or cools the core.
    """
    stated = {kind: run.nuisances(kind) for track in run.tracks for kind in track.by_kind()}
    late = {kind: one for kind, one in stated.items() if one is not None and one.creep}
    always = run.scene.drive or run.scene.environment.indenter_temperature or "creep" in run.forced
    if not late or (not always and _negligible(run, late)):
        return
    for track in run.tracks:
        for kind in late.keys() & track.by_kind().keys():
            fractions = [term.fraction.to("1") for term in late[kind].creep]
            effective: FloatArray = (1.0 - sum(fractions)) * track.force_n
            for fraction, term in zip(fractions, late[kind].creep, strict=True):
                effective = effective + fraction * lag(track.t_s, track.force_n, term.tau.to("s"))
            # A weighted mean of earlier forces: rounding must not leave the table's range.
            track.effective_n[kind] = np.clip(effective, track.force_n.min(), track.force_n.max())


def steepest_n_per_s(load: Load) -> float:
    """Return the largest rate of change [N/s] of a load; infinity for a step."""
    rises, steps = np.abs(np.diff(load.force_n)), np.diff(load.t_s)
    with np.errstate(divide="ignore"):
        return float(np.max(rises[rises > 0] / steps[rises > 0], initial=0.0))


def bounds(run: Synthesis, late: dict[ChannelKind, Nuisances], rate_n_per_s: float) -> dict[ChannelKind, float]:
    """Return, by kind of channel, an upper bound [count] of the error of readings if creep is left out.

    If the load changes at most at a rate ``r``, a lag of time constant ``tau`` is behind it by at most ``tau r``. So
    the force is off by at most ``r sum(c_i tau_i)``, and a reading by this times its largest slope: the largest in the
    recording's load table, over the forces that occur, times the channel's own gain. For channels that the table does
    not hold the bound is infinity.
    """
    table, names = skin_under_load(run), read_names(run)
    found = dict.fromkeys(late, 0.0)
    for track in run.tracks:
        slopes = table.steepest(float(track.force_n.min()), float(track.force_n.max()))
        for kind, own in track.by_kind().items():
            if kind not in late:
                continue
            slope = np.inf
            if kind in READ_FROM_THE_SKIN:
                among = slopes[[names.index(track.channels[column].name) for column in own]]
                slope = float(np.max(among if track.gain is None else np.abs(track.gain[own]) * among))
            late_s = sum(term.fraction.to("1") * term.tau.to("s") for term in late[kind].creep)
            found[kind] = max(found[kind], slope * late_s * rate_n_per_s)
    return found


def _negligible(run: Synthesis, late: dict[ChannelKind, Nuisances]) -> bool:
    """Decide whether creep is left out, enter the decision and its bound into the plan, and return it."""
    rate = steepest_n_per_s(run.load)
    found = bounds(run, late, rate)
    hidden = {kind: late[kind].hidden(run.scene.environment.noise_scale) for kind in found}
    most = max(found.values())
    left_out = all(found[kind] <= hidden[kind] / 3 for kind in found)
    text = f"up to {most:.2g} counts come late at {rate:.2g} N/s, by the slopes of the scene's load table"
    if left_out:
        text += f": below a third of noise and rounding ({min(hidden.values()):.2g})"
    run.settled["creep"] = Settled(not left_out, text, most)
    return left_out
