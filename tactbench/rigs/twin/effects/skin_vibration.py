"""Vibration of the skin along its normal while a rough surface slides over it, and the fluid's dynamic pressure."""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import ChannelSpec, FloatArray, NotApplicable, Quantity, assumed
from tactbench.plugin.simulation import Surface
from tactbench.rigs.twin.contact.stages import READ_FROM_THE_SKIN, round_contact_mm, skin_under_load
from tactbench.rigs.twin.effects.friction import mode_of
from tactbench.rigs.twin.effects.memory import lag
from tactbench.rigs.twin.effects.stick_slip import shaken
from tactbench.rigs.twin.synthesis import Synthesis

LIFT: Quantity = assumed(
    0.03, "1", "a patch of a round finger that moves by x along it moves by x^2/(2 Ro) into it: x/Ro at 0.25 mm"
)
"""Ratio of normal to tangential motion of the skin, for sensors whose parameters state no ``skin_lift``."""
COMPONENTS = 48
"""Number of cosines of a rough profile: enough for a nearly Gaussian one; it determines the computing time."""
LONGEST_MM, SHORTEST_MM = 100.0, 0.02
"""Limits of the cosines' wavelengths (assumed): at 20 mm/s longer ones take over 5 s, shorter ones exceed the band."""
_RADII = 1025
"""Number of contact radii for which means are computed; linear interpolation between them is right to 1e-4."""


def apply(run: Synthesis) -> None:
    """Compute the vibration of the skin, caused by a rough profile and by stick-slip, for every clock that reads it.

    The indenter is held at its height at the beginning of the slip, so that the passing profile moves the skin (through
    its resonance) and changes the measured normal force. The tangential motion of stick-slip (computed with the same
    resonance) lifts the skin in proportion: only dynamic pressure includes it, because the proportion is known for a
    motion and not for a place.
    """
    slide = run.scene.slide
    if slide is None or run.sliding is None:
        return
    mode = mode_of(run.sensor.spec)
    lift = run.sensor.spec.parameters.get("skin_lift", LIFT).to("1")
    profile, table = Profile(slide.surface, run.of_recording("roughness")), skin_under_load(run)

    def rough(t_s: FloatArray, force_n: FloatArray, slip_mm: FloatArray) -> FloatArray:
        radius = round_contact_mm(run, force_n)
        risen = profile.felt_mm(slip_mm, radius) - profile.felt_mm(np.zeros(slip_mm.size), radius)
        return shaken(t_s, np.where(force_n > 0, risen, 0.0), mode)

    for track in run.tracks:
        kinds = track.by_kind()
        if "ac_pressure" not in kinds and not kinds.keys() & set(READ_FROM_THE_SKIN):
            continue
        seen = run.sliding(track.t_s)
        track.vibration_mm = rough(track.t_s, track.force_n, seen.slip_mm)
        if "ac_pressure" in kinds:
            run.drawn["remark vibration"] = (
                "above 100 Hz ac_pressure shows only stick-slip and noise: a steady slide is as quiet as rest"
            )
            track.vibration_mm += np.where(track.force_n > 0, lift * seen.displacement_mm, 0.0)
    force_n = run.load.at(run.t_s)
    stiffness = table.per_mm(lambda force_n: force_n[:, None], force_n)[:, 0]
    run.reference_n += stiffness * rough(run.t_s, force_n, run.sliding(run.t_s).slip_mm)


class Profile:
    """A random self-affine height profile of a surface, drawn once: afterwards a fixed function of the place.

    Its spectrum over the wave number k is even up to the roll-off and falls as ``k^-(1 + 2 H)`` beyond (Persson et al.
    2005, J. Phys.: Condens. Matter 17 R1). Each of equal steps in ln k gives one cosine with the step's share of the
    variance; its place within the step and its phase are drawn uniformly from `generator`.
    """

    def __init__(self, surface: Surface, generator: np.random.Generator) -> None:
        edges = np.geomspace(2.0 * np.pi / LONGEST_MM, 2.0 * np.pi / SHORTEST_MM, COMPONENTS + 1)
        roll_off, twice_hurst = 2.0 * np.pi / surface.roll_off.to("mm"), 2.0 * surface.hurst.to("1")
        beyond = np.maximum(edges / roll_off, 1.0)
        below = np.minimum(edges / roll_off, 1.0) + (1.0 - beyond**-twice_hurst) / twice_hurst
        shares = np.diff(below) / (below[-1] - below[0])
        self._wave_per_mm = edges[:-1] * (edges[1] / edges[0]) ** generator.uniform(size=COMPONENTS)
        self._phase = generator.uniform(0.0, 2.0 * np.pi, COMPONENTS)
        self._amplitude_mm = surface.roughness.to("mm") * np.sqrt(2.0 * shares)

    def felt_mm(self, place_mm: FloatArray, contact_radius_mm: FloatArray) -> FloatArray:
        """Return the (n,) means of the profile [mm] over contacts of (n,) radii around (n,) places."""
        height = np.zeros(place_mm.size)
        radii = np.linspace(0.0, float(contact_radius_mm.max(initial=0.0)), _RADII)
        for wave, phase, amplitude in zip(self._wave_per_mm, self._phase, self._amplitude_mm, strict=True):
            felt = np.interp(contact_radius_mm, radii, amplitude * patch_mean(wave * radii))
            height += felt * np.cos(wave * place_mm + phase)
        return height


def patch_mean(turn: FloatArray) -> FloatArray:
    """Return the mean of a cosine over a round contact, relative to the cosine's value at the contact's centre.

    The weight is the Hertzian pressure ``sqrt(1 - r^2/a^2)``, which gives ``3 (sin k - k cos k)/k^3`` with
    ``k = 2 pi a/wavelength``, the Fourier transform of a ball.
    """
    small = np.abs(turn) < 0.05
    safe = np.where(small, 1.0, turn)
    # By its series for small arguments, where the difference loses its digits: next term below 2e-10.
    series = 1.0 - turn**2 / 10.0 + turn**4 / 280.0
    return np.where(small, series, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)


def ac_pressure(run: Synthesis) -> None:
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
