"""Creep: part of a channel's response follows the load with a delay."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import ChannelKind, FloatArray
from tactbench.plugin.simulation import Nuisances
from tactbench.rigs.twin.contact.stages import READ_FROM_THE_SKIN, read_names, skin_under_load
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.synthesis import Load, Settled, Synthesis, Track


def apply(run: Synthesis) -> None:
    """Replace the force that each kind of channel follows by ``F (1 - sum c_i) + sum c_i lag_i(F)``.

    Linear viscoelasticity acts on the force before the load table is evaluated: hysteresis follows from its history.
    It is left out, and the plan is updated, where it changes no reading by more than a third of noise and rounding
    (:func:`bounds`), unless the scene asks for it by name or has a motor's force loop.
    """
    stated = {kind: run.nuisances(kind) for track in run.tracks for kind in track.by_kind()}
    late = {kind: one for kind, one in stated.items() if one is not None and one.creep}
    if late and run.scene.drive is None and "creep" not in run.forced and _settled(run, late):
        return
    for track in run.tracks:
        for kind in track.by_kind():
            if kind in late:
                fractions = [term.fraction.to("1") for term in late[kind].creep]
                effective: FloatArray = (1.0 - sum(fractions)) * track.force_n
                for fraction, term in zip(fractions, late[kind].creep, strict=True):
                    effective = effective + fraction * lag(track.t_s, track.force_n, term.tau.to("s"))
                # A weighted mean of forces that were: rounding must not leave the table's range.
                track.effective_n[kind] = np.clip(effective, track.force_n.min(), track.force_n.max())


def steepest_n_per_s(load: Load) -> float:
    """Return the largest rate at which a load changes."""
    steps, rises = np.diff(load.t_s), np.abs(np.diff(load.force_n))
    moving = rises > 0
    if not moving.any():
        return 0.0
    with np.errstate(divide="ignore"):  # a step of force in no time: any rate
        return float(np.max(rises[moving] / steps[moving]))


def bounds(run: Synthesis, late: dict[ChannelKind, Nuisances]) -> dict[ChannelKind, tuple[float, float]]:
    """Return, by kind, a bound on the change by leaving creep out [count] and the slope it rests on [count/N].

    Behind a load that changes at most at a rate ``r`` a lag of time constant ``tau`` stays back by at most ``tau r``.
    So the force is off by at most ``r sum(c_i tau_i)``, and a reading by that times its largest slope: that of the
    load table this recording is made from, over the forces that occur, times the channel's own gain, and times what a
    drift with the fluid's temperature may make of a difference. Nothing is known (infinity) of channels that the table
    does not hold.
    """
    rate, table, names = steepest_n_per_s(run.load), skin_under_load(run), read_names(run)
    found: dict[ChannelKind, tuple[float, float]] = {}
    for track in run.tracks:
        for kind, own in track.by_kind().items():
            if kind not in late:
                continue
            late_s = sum(term.fraction.to("1") * term.tau.to("s") for term in late[kind].creep)
            slope = np.inf
            if kind in READ_FROM_THE_SKIN:
                steepest = table.steepest(float(track.force_n.min()), float(track.force_n.max()))
                slope = _steepest(track, own, names, steepest)
            if kind == "taxel" and run.scene.environment.indenter_temperature is not None:
                from tactbench.rigs.twin.effects.heat import largest_stretch

                slope *= largest_stretch(run)
            found[kind] = max(found.get(kind, (0.0, 0.0)), (slope * late_s * rate, slope))
    return found


def _steepest(track: Track, own: list[int], names: list[str], slopes: FloatArray) -> float:
    slope = slopes[[names.index(track.channels[column].name) for column in own]]
    return float(np.max(slope if track.gain is None else np.abs(track.gain[own]) * slope))


def _settled(run: Synthesis, late: dict[ChannelKind, Nuisances]) -> bool:
    """Decide whether creep is left out, enter the decision and its bound into the plan, and return it."""
    found = bounds(run, late)
    hidden = {kind: late[kind].hidden(run.scene.environment.noise_scale) for kind in found}
    most, slope = max(found.values())
    rate, slowest = steepest_n_per_s(run.load), max(term.tau.to("s") for one in late.values() for term in one.creep)
    behind = f"{most:.2g} counts late at {rate:.2g} N/s and up to {slope:.3g} counts/N in the scene's load table"
    if all(most <= hidden[kind] / 3 for kind, (most, _) in found.items()):
        least = min(hidden.values())
        slowly = f"the load changes slowly against {slowest:g} s: at most {behind}"
        run.settled["creep"] = Settled(False, f"{slowly}, below a third of noise and rounding ({least:.2g})", most)
        return True
    run.settled["creep"] = Settled(
        True, f"part of the response comes late, by up to {slowest:g} s: up to {behind}", most
    )
    return False
