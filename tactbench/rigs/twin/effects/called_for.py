"""Functions that decide which effects a scene needs, without solving a contact.

Each function takes the scene and the sensor's spec and returns a Reason: the decision, its text, and a bound on the
change of the readings if the effect is left out.
"""

from __future__ import annotations

import math
from functools import partial

from tactbench.plugin import ChannelKind, Quantity, Scene, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, Nuisances, Reason

NEEDED = ("heater_power", "heat_resistance", "heat_capacity")
"""Names of the parameters that a sensor with a heated core must state."""
THERMISTOR = ("thermistor_b", "thermistor_p", "thermistor_q")
"""Names of the parameters that a sensor with a thermistor must state."""
NOT_OBSERVED = "no observed channel depends on it"
NO_LOAD = "the scene has no load: 0 N throughout"
NO_FLUID = "the skin holds no fluid"


def _no(text: str, unit: str = "count") -> Reason:
    """Return a Reason to leave out an effect that would change nothing."""
    return Reason(False, text, 0.0, unit)


def _observed(scene: Scene, sensor: SensorSpec) -> list[Nuisances]:
    return [sensor.nuisances[kind] for kind in scene.observe if kind in sensor.nuisances]


def _largest(scene: Scene, sensor: SensorSpec, *fields: str) -> Quantity | None:
    """Return the largest of the nuisances `fields` of all observed channel kinds; None if the spec states none."""
    found = [getattr(nuisances, field) for nuisances in _observed(scene, sensor) for field in fields]
    return max((one for one in found if one is not None), key=lambda quantity: quantity.value, default=None)


def _under_load(scene: Scene, text: str, unit: str = "count") -> Reason:
    """Return a Reason to include an effect in a scene with a load, or to leave it out of a scene without load."""
    return Reason(True, text, None, unit) if scene.profile.largest_n > 0 else _no(NO_LOAD, unit)


def _scaled(scale: float, size: Quantity | None, what: str, text: str) -> Reason:
    if size is None or not size.value:
        return _no(f"the spec states no {what} for the observed channels")
    if not scale:
        return _no(f"the scene scales {what} by 0")
    return Reason(True, f"{text.format(size)}, scaled by {scale:g}", scale * size.value, size.unit)


# The press and what reads it.


def force_loop(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes the force loop: a motor under force control presses the indenter."""
    drive = scene.drive
    if drive is None:
        return _no("the scene declares no drive: the force follows its profile, 0 N off", "N")
    filtered = "unfiltered" if drive.cutoff is None else f"behind a low-pass at {drive.cutoff}"
    steps = "a step per sample" if drive.rate is None else f"steps at {drive.rate}"
    return _under_load(scene, f"a motor presses by the measured force, {filtered}, {drive.delay} late, {steps}", "N")


def contact(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes contact: an indenter presses the skin."""
    return _under_load(scene, f"{scene.indenter} pressed with up to {scene.profile.largest_n:g} N")


def core(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes the rigid core: the skin may touch it through a fluid film."""
    if not isinstance(sensor.skin, FluidBackedShell):
        return _no("the skin has no core under a fluid film")
    left = sensor.skin.film.most_mm - sensor.skin.residual_film.to("mm")
    return _under_load(scene, f"taken into the solve from the load that leaves no more than the film's {left:g} mm")


def fluid_pressure(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes fluid pressure: an observed channel reads that of a fluid in the skin."""
    if not isinstance(sensor.skin, FluidBackedShell):
        return _no(NO_FLUID)
    return Reason(True, "an observed channel reads the pressure of the fluid")


def shear(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes shear: an observed channel reads the tangential state of the skin."""
    looking = [kind for kind in sensor.reads_shear if kind in scene.observe]
    if not looking:
        return _no("no observed channel responds to tangential motion of the skin")
    slides = "; the slide drags it" if _slides(scene).called_for else ""
    return _under_load(scene, f"{' and '.join(looking)} channels read the tangential displacement of the skin{slides}")


def creep(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes creep: readings may lag behind a changing load.

    The size of the lag depends on the slope of the readings, known only from the load table: the effect is possibly
    left out after the contact is solved (`tactbench.rigs.twin.effects.creep`).
    """
    terms = [term for nuisances in _observed(scene, sensor) for term in nuisances.creep]
    share = sum(term.fraction.to("1") for term in terms)
    if not terms or not share:
        return _no("the spec states no creep for the observed channels")
    profile = scene.profile
    if scene.drive is None and len(set(profile.corners[1])) == 1:
        return _no(f"the load is constant: {profile.corners[1][0]:g} N throughout")
    slowest = max(term.tau.to("s") for term in terms)
    return Reason(True, f"{100 * share:.0f} % of the response comes late, by up to {slowest:g} s")


def transduction(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return the Reason to compute the observed channels from the state of the skin."""
    return Reason(True, f"{sensor.principle} channels read the skin")


# Units, levels, drift, noise.


def gain(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes gain differences between the channels of one sensor unit."""
    scatter = _largest(scene, sensor, "gain_scatter")
    unit = None if scene.first_unit else _largest(scene, sensor, "unit_gain")
    within, between = (0.0 if one is None else one.to("1") for one in (scatter, unit))
    if not within and not between:
        return _no("the spec states no scatter of gain for the observed channels")
    other = f", and unit {scene.unit} by {100 * between:g} % as a whole" if between else ""
    return Reason(True, f"gains scatter by {100 * within:g} % within a unit{other}")


def unit_rest(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes rest levels that differ between sensor units."""
    if scene.first_unit:
        return _no("unit 1 is the one that the spec describes")
    largest = _largest(scene, sensor, "unit_rest_shared", "unit_rest_own")
    if largest is None or not largest.value:
        return _no("the spec states no spread of rest levels from unit to unit")
    return Reason(True, f"levels of unit {scene.unit} differ by {largest} (sd)", largest.value, largest.unit)


def rest_spread(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes rest levels that differ between the channels of one sensor unit."""
    spread = sensor.parameters.get("rest_spread")
    if spread is None or not spread.value:
        return _no("the spec states rest levels channel by channel")
    return Reason(True, f"rest levels scatter by {spread} within a unit", spread.value, spread.unit)


def offset(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes reading offsets that differ between recordings."""
    environment, session = scene.environment, _largest(scene, sensor, "offset_session")
    if session is not None and session.value and environment.session_offset_scale:
        return _scaled(environment.session_offset_scale, session, "offset", "levels move by {} (sd) between sessions")
    largest = _largest(scene, sensor, "offset_shared", "offset_own")
    text = "levels move by {} (sd) between recordings; between sessions by nothing more"
    return _scaled(environment.scale_of_offsets, largest, "offset", text)


def warm_up(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes the rise of the rest levels while the sensor warms up."""
    rise, tau = _largest(scene, sensor, "warm_up"), _largest(scene, sensor, "warm_up_tau")
    reason = _scaled(scene.environment.drift_scale, rise, "warm-up", "rest levels rise by {} from power-on")
    if not reason.called_for or tau is None or reason.change is None:
        return reason
    since = scene.environment.since_power_on.to("s") + scene.starts_after_s
    return reason._replace(change=reason.change * math.exp(-since / tau.to("s")))


def wander(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes a slow random drift of each channel."""
    spread = _largest(scene, sensor, "wander")
    return _scaled(scene.environment.drift_scale, spread, "free drift", "channels wander by {} (sd)")


def white_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes white noise, an independent error of every sample."""
    return _scaled(scene.environment.noise_scale, _largest(scene, sensor, "white"), "white noise", "noise of {} (sd)")


def hum(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes a hum of the dynamic pressure without contact."""
    size = sensor.parameters.get("hum")
    if size is None or "ac_pressure" not in scene.observe:
        return _no("no observed channel has a hum")
    text = f"{{}} rms between {sensor.parameters['hum_low']} and {sensor.parameters['hum_high']}"
    return _scaled(scene.environment.noise_scale, size, "hum", text)


def converter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return the Reason to apply the analog-to-digital converter, which every scene includes."""
    step = _largest(scene, sensor, "step")
    stated = f"steps of {step}, " if step is not None and step.value else ""
    half = None if step is None else step.value / 2
    return Reason(True, f"{stated}clipped to each channel's range", half)


def force_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes noise of the reference force sensor."""
    noise = scene.environment.force_noise
    if not noise.value:
        return _no("the scene's force sensor is free of noise", "N")
    return Reason(True, f"the unfiltered force sensor errs by {noise} (sd)", noise.to("N"), "N")


def force_filter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes a low-pass filter of the reference force."""
    cutoff = scene.environment.force_filter
    if cutoff is None:
        return _no("the force is recorded unfiltered: no cut-off, 0 N off", "N")
    return Reason(True, f"recorded behind a low-pass at {cutoff}", None, "N")


# Sliding.


def _slides(scene: Scene) -> Reason:
    slide = scene.slide
    if slide is None:
        return _no("no tangential motion: the scene does not slide")
    late = slide.start.to("s") - scene.profile.duration.to("s")
    if late >= 0:
        return _no(f"the slide would start {late:g} s after the recording's end")
    return _under_load(scene, f"slides at {slide} under up to {scene.profile.largest_n:g} N")


def friction(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes friction: a loaded surface moves over the skin."""
    found = _slides(scene)
    if scene.slide is None or not found.called_for:
        return found
    surface = scene.slide.surface
    return found._replace(
        text=f"{found.text}; friction {surface.static_friction.value:g} to {surface.kinetic_friction.value:g}"
    )


def skin_vibration(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes a vibration of the skin under a sliding rough surface."""
    found = _slides(scene)
    if not found.called_for or scene.slide is None:
        return found
    surface = scene.slide.surface
    per_s = scene.slide.speed.to("mm/s") / surface.roll_off.to("mm")
    return found._replace(text=f"a profile of {surface.roughness} rms passes, its spectrum even up to {per_s:g} Hz")


def ac_pressure(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes dynamic fluid pressure: a channel of this kind is observed."""
    if "ac_pressure" not in scene.observe:
        return _no("no channel of dynamic pressure is observed")
    if not isinstance(sensor.skin, FluidBackedShell):
        return _no(NO_FLUID)
    bands = [str(channel.band) for channel in sensor.channels("ac_pressure") if channel.band is not None]
    if not bands:
        return _no("no channel of dynamic pressure states its band")
    return Reason(True, f"the fluid's pressure within {bands[0]}")


# Heat.


def _thermistor(kind: ChannelKind, needed: tuple[str, ...], scene: Scene, sensor: SensorSpec) -> Reason:
    if kind not in scene.observe:
        return _no(NOT_OBSERVED)
    missing = [name for name in (*needed, *NEEDED) if name not in sensor.parameters]
    if missing:
        return _no(f"the spec states no {', '.join(missing)}")
    rise = sensor.parameters["heater_power"].to("W") * sensor.parameters["heat_resistance"].to("K/W")
    return Reason(True, f"an observed channel reads a core that its heater keeps {rise:.0f} K above the room")


dc_temperature = partial(_thermistor, "dc_temperature", THERMISTOR)
"""Function that decides whether the scene includes steady temperature: a thermistor gives an observed channel."""
ac_temperature = partial(_thermistor, "ac_temperature", (*THERMISTOR, "thermal_high_pass", "thermal_gain"))
"""Function that decides whether the scene includes changing temperature: a thermistor gives an observed channel."""


def contact_heat(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes heat flow through the contact: it states a temperature of the indenter."""
    missing = [name for name in (*NEEDED, "contact_conductivity") if name not in sensor.parameters]
    if missing:
        return _no(f"the spec states no {', '.join(missing)}")
    indenter = scene.environment.indenter_temperature
    if indenter is None:
        return _no("the scene's indenter is as warm as what it touches: 0 K apart")
    return _under_load(
        scene, f"an indenter at {indenter} touches a heated core in a room at {scene.environment.ambient}"
    )


def thermal_drift(scene: Scene, sensor: SensorSpec) -> Reason:
    """Decide whether the scene includes the change of resistive channels by a core that the contact warms or cools."""
    coefficient = sensor.parameters.get("conductivity_coefficient")
    if "taxel" not in scene.observe:
        return _no(NOT_OBSERVED)
    if coefficient is None:
        return _no("the spec states no coefficient of a fluid's conductivity")
    found = contact_heat(scene, sensor)
    if not found.called_for:
        return found
    return Reason(True, f"conductivity changes by {100 * coefficient.to('1/K'):g} % of that at 25 degC per kelvin")
