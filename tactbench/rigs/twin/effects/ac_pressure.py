"""Dynamic pressure: the fluid's pressure within the band of its channel."""

from __future__ import annotations

import math

from tactbench.plugin import ChannelSpec, FloatArray, NotApplicable
from tactbench.rigs.twin.contact.stages import skin_under_load
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add the band-passed pressure of the fluid to every channel of dynamic pressure.

    The fluid's pressure follows the load; a vibration of the skin adds its amplitude times the slope of the pressure
    with depth at that load, so that no separate parameter is needed.
    """
    table = skin_under_load(run)
    for track in run.tracks:
        columns = track.by_kind().get("ac_pressure", [])
        pressure_mpa = table.skin(track.force_n).fluid_pressure_mpa
        if track.vibration_mm is not None:
            slope = table.per_mm(lambda loads_n: table.skin(loads_n).fluid_pressure_mpa[:, None], track.force_n)
            pressure_mpa = pressure_mpa + slope[:, 0] * track.vibration_mm
        for column in columns:
            channel = track.channels[column]
            if channel.scale is None:
                raise NotApplicable(
                    f"{channel.name} states no scale (Pa/count), which is needed to convert its pressure to counts.",
                    hint="State the channel's scale (Pa/count) in the sensor's spec.",
                )
            passed_pa = within_band(track.t_s, 1e6 * pressure_mpa, channel)
            track.readings[:, column] += passed_pa / channel.scale.to("Pa/count")


def within_band(t_s: FloatArray, pressure_pa: FloatArray, channel: ChannelSpec) -> FloatArray:
    """Return (n,) pressures, linear between samples, filtered by the band of a channel.

    The filters are a first-order high-pass and a first-order low-pass with their corners at the band's ends, exact for
    any step. The makers state the ends; no source states the order.
    """
    if channel.band is None:
        raise NotApplicable(
            f"{channel.name} states no band (Hz), which is needed to filter its pressure.",
            hint="State the channel's band in the sensor's spec.",
        )
    low, high = channel.band.lower, channel.band.upper
    passed = pressure_pa - lag(t_s, pressure_pa, 1.0 / (2.0 * math.pi * low))
    return lag(t_s, passed, 1.0 / (2.0 * math.pi * high))
