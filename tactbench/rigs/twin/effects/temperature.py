"""The channels of temperature: the thermistor's reading, and the amplified rate at which it changes."""

from __future__ import annotations

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.effects.heated_core import HeatedCore
from tactbench.rigs.twin.effects.memory import lag, time_constant_s
from tactbench.rigs.twin.effects.thermistor import Thermistor
from tactbench.rigs.twin.synthesis import Synthesis, Track


def read_dc(run: Synthesis) -> None:
    """Let the channels of steady temperature say what the thermistor does, behind its low-pass."""
    for track in run.tracks:
        for column in track.by_kind().get("dc_temperature", []):
            reading = _thermistor(run, track, column)
            rest = track.channels[column].rest
            if reading is not None:
                # Tracks start at rest; the thermistor's own formula says where this core stands instead.
                track.readings[:, column] += reading - (0.0 if rest is None else rest.value)


def read_ac(run: Synthesis) -> None:
    """Let the channels of changing temperature add the thermistor's reading, high-passed and amplified."""
    stated = run.sensor.spec.parameters
    if "thermal_high_pass" not in stated or "thermal_gain" not in stated:
        return
    tau_s, gain = time_constant_s(stated["thermal_high_pass"].to("Hz")), stated["thermal_gain"].to("1")
    for track in run.tracks:
        for column in track.by_kind().get("ac_temperature", []):
            reading = _thermistor(run, track, column)
            if reading is not None:
                track.readings[:, column] += gain * (reading - lag(track.t_s, reading, tau_s))


def _thermistor(run: Synthesis, track: Track, column: int) -> FloatArray | None:
    """Return the (n,) readings of the thermistor in counts of the channel; None if the spec declares none."""
    core = HeatedCore.of(run.scene, run.sensor.spec)
    thermistor = Thermistor.of(run.sensor.spec, track.channels[column].upper or 1.0)
    if core is None or thermistor is None:
        return None
    degc = core.untouched(run.scene, track.t_s)
    if track.warmth_k is not None:
        degc = degc + track.warmth_k
    reading = thermistor.reading(degc)
    low_pass = run.sensor.spec.parameters.get("thermal_low_pass")
    return reading if low_pass is None else lag(track.t_s, reading, time_constant_s(low_pass.to("Hz")))
