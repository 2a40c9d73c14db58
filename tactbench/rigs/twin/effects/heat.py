"""Effects of heat flow through the contact on the core, the temperature channels and the resistive channels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactbench.plugin import ChannelKind, FloatArray
from tactbench.rigs.twin.contact.stages import round_contact_mm
from tactbench.rigs.twin.effects.heated_core import (
    HeatedCore,
    Thermistor,
    disc_conductance_w_per_k,
    relative_conductivity,
)
from tactbench.rigs.twin.effects.memory import lag, time_constant_s
from tactbench.rigs.twin.synthesis import Synthesis, Track


def contact_heat(run: Synthesis) -> None:
    """Compute the temperature change of the core by heat flow between core and indenter through the contact's area."""
    core = HeatedCore.of(run.scene, run.sensor.spec)
    indenter = run.scene.environment.indenter_temperature
    conductivity = run.sensor.spec.parameters.get("contact_conductivity")
    if core is None or indenter is None or conductivity is None:
        return
    for track in run.tracks:
        conductance = disc_conductance_w_per_k(round_contact_mm(run, track.force_n), conductivity.to("W/m/K"))
        track.warmth_k = core.warmth(run.scene, track.t_s, conductance, indenter.to("degC"))


def dc_temperature(run: Synthesis) -> None:
    """Set the channels of steady temperature to the low-passed reading of the thermistor."""
    for track, column, reading in _thermistor(run, "dc_temperature"):
        rest = track.channels[column].rest
        # Tracks start at rest; the thermistor's formula gives the level of this core instead.
        track.readings[:, column] += reading - (0.0 if rest is None else rest.value)


def ac_temperature(run: Synthesis) -> None:
    """Add the high-passed, amplified reading of the thermistor to the channels of changing temperature."""
    stated = run.sensor.spec.parameters
    if "thermal_high_pass" not in stated or "thermal_gain" not in stated:
        return
    tau_s, gain = time_constant_s(stated["thermal_high_pass"].to("Hz")), stated["thermal_gain"].to("1")
    for track, column, reading in _thermistor(run, "ac_temperature"):
        track.readings[:, column] += gain * (reading - lag(track.t_s, reading, tau_s))


def _thermistor(run: Synthesis, kind: ChannelKind) -> Iterator[tuple[Track, int, FloatArray]]:
    """Yield the channels of a kind, and the (n,) readings of the thermistor in their counts; none without one."""
    core, low_pass = HeatedCore.of(run.scene, run.sensor.spec), run.sensor.spec.parameters.get("thermal_low_pass")
    for track, column in run.columns(kind):
        thermistor = Thermistor.of(run.sensor.spec, track.channels[column].upper or 1.0)
        if core is not None and thermistor is not None:
            degc = core.untouched(run.scene, track.t_s)
            reading = thermistor.reading(degc if track.warmth_k is None else degc + track.warmth_k)
            if low_pass is not None:
                reading = lag(track.t_s, reading, time_constant_s(low_pass.to("Hz")))
            yield track, column, reading


def thermal_drift(run: Synthesis) -> None:
    """Scale each reading's resistance by the ratio of the fluid's conductivities without and with the contact.

    This is the change by the contact only: the measured rise of readings while the core warms up is in the effect
    "warm-up".
    """
    core = HeatedCore.of(run.scene, run.sensor.spec)
    coefficient = run.sensor.spec.parameters.get("conductivity_coefficient")
    if core is None or coefficient is None:
        return
    per_k = coefficient.to("1/K")
    for track, column in run.columns("taxel"):
        upper = track.channels[column].upper
        if track.warmth_k is not None and upper is not None:
            untouched = core.untouched(run.scene, track.t_s)
            gained = relative_conductivity(untouched + track.warmth_k, per_k)
            gained = gained / relative_conductivity(untouched, per_k)
            track.readings[:, column] = through_divider(track.readings[:, column], gained, upper)


def through_divider(reading: FloatArray, gained: FloatArray, full_scale: float) -> FloatArray:
    """Return a voltage divider's reading ``E = top/(1 + R/R_ref)`` after its resistance falls by the factor `gained`.

    Readings at or beyond the ends (no resistance, or no conductance) stay as they are.
    """
    inside = (reading > 0) & (reading < full_scale)
    share = np.where(inside, reading, 0.0) / full_scale
    return np.where(inside, gained * reading / (1.0 + (gained - 1.0) * share), reading)
