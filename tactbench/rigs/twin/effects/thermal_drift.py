"""Drift of resistive channels with the temperature of their fluid, as far as the contact changes it."""

from __future__ import annotations

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.heated_core import HeatedCore, relative_conductivity
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Scale the resistance behind each reading by the fluid's conductivity without the contact over that with it.

    Only the change by the contact: how readings rise while the core warms up is measured, and the effect "warm-up"
    holds it.
    """
    core = HeatedCore.of(run.scene, run.sensor.spec)
    coefficient = run.sensor.spec.parameters.get("conductivity_coefficient")
    if core is None or coefficient is None:
        return
    per_k = coefficient.to("1/K")
    for track in run.tracks:
        if track.warmth_k is None:
            continue
        alone = core.untouched(run.scene, track.t_s)
        gained = relative_conductivity(alone + track.warmth_k, per_k) / relative_conductivity(alone, per_k)
        for column in track.by_kind().get("taxel", []):
            upper = track.channels[column].upper
            if upper is not None:
                track.readings[:, column] = through_divider(track.readings[:, column], gained, upper)


def largest_stretch(run: Synthesis) -> float:
    """Return by what factor a difference between two readings may grow on its way through :func:`apply`, at least 1.

    A divider's reading behind a resistance divided by g has the slope ``g / (1 + (g - 1) E/top)²`` against the reading
    E before, which is at most g or 1/g. The core is never warmer or colder than its untouched self and the indenter.
    """
    core = HeatedCore.of(run.scene, run.sensor.spec)
    coefficient = run.sensor.spec.parameters.get("conductivity_coefficient")
    indenter = run.scene.environment.indenter_temperature
    if core is None or coefficient is None or indenter is None:
        return 1.0
    ends = core.untouched(run.scene, run.t_s[[0, -1]])  # it moves one way only
    untouched = relative_conductivity(ends, coefficient.to("1/K"))
    reached = relative_conductivity(np.append(ends, indenter.to("degC")), coefficient.to("1/K"))
    return float(max(reached.max() / untouched.min(), untouched.max() / reached.min()))


def through_divider(reading: FloatArray, gained: FloatArray, full_scale: float) -> FloatArray:
    """Return what a divider reads when its resistance falls by the factor `gained`: ``E = top/(1 + R/R_ref)``.

    Readings at or beyond the ends (no resistance, or no conductance) stay as they are.
    """
    inside = (reading > 0) & (reading < full_scale)
    share = np.where(inside, reading, 0.0) / full_scale
    return np.where(inside, gained * reading / (1.0 + (gained - 1.0) * share), reading)
