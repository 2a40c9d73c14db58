"""Predicates that decide which effects a scene calls for, without solving a contact.

Each takes the scene and the sensor's spec and returns a Reason: the decision, its text, and a bound on what leaving the
effect out would change.
"""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import ChannelKind, Quantity, Scene, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, Nuisances, Reason, SkinSheet
from tactbench.rigs.twin.effects.heated_core import NEEDED, THERMISTOR, HeatedCore

NOT_OBSERVED = "no observed channel depends on it"
NO_LOAD = "the scene has no load: 0 N throughout"
NO_FLUID = "the skin holds no fluid"
_HEATED: tuple[ChannelKind, ...] = ("taxel", "dc_temperature", "ac_temperature")


def _no(text: str, unit: str = "count") -> Reason:
    """Return the reason of an effect that changes nothing."""
    return Reason(False, text, 0.0, unit)


def _observed(scene: Scene, sensor: SensorSpec) -> list[Nuisances]:
    return [sensor.nuisances[kind] for kind in scene.observe if kind in sensor.nuisances]


def _largest(scene: Scene, sensor: SensorSpec, *fields: str) -> Quantity | None:
    """Return the largest quantity in these fields of the observed kinds' nuisances; None if the spec states none."""
    found = [getattr(nuisances, field) for nuisances in _observed(scene, sensor) for field in fields]
    return max((one for one in found if one is not None), key=lambda quantity: quantity.value, default=None)


def _scaled(scale: float, size: Quantity | None, what: str, text: str) -> Reason:
    if size is None or not size.value:
        return _no(f"the spec states no {what} for the observed channels")
    if not scale:
        return _no(f"the scene scales {what} by 0")
    return Reason(True, f"{text.format(size)}, scaled by {scale:g}", scale * size.value, size.unit)


# The press and what reads it.


def force_loop(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a motor under force control presses."""
    drive = scene.drive
    if drive is None:
        return _no("the scene declares no drive: the force follows its profile, 0 N off", "N")
    if not scene.profile.largest_n > 0:
        return _no(NO_LOAD, "N")
    filtered = "unfiltered" if drive.cutoff is None else f"behind a low-pass at {drive.cutoff}"
    steps = "a step per sample" if drive.rate is None else f"steps at {drive.rate}"
    return Reason(True, f"a motor presses by the measured force, {filtered}, {drive.delay} late, {steps}", None, "N")


def contact(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether the skin is pressed."""
    if not scene.profile.largest_n > 0:
        return _no(NO_LOAD)
    return Reason(True, f"{scene.indenter} pressed with up to {scene.profile.largest_n:g} N")


def core(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether the skin may touch a core under a fluid film."""
    if not isinstance(sensor.skin, FluidBackedShell):
        return _no("the skin has no core under a fluid film")
    if not scene.profile.largest_n > 0:
        return _no(NO_LOAD)
    left = sensor.skin.film.most_mm - sensor.skin.residual_film.to("mm")
    return Reason(True, f"taken into the solve from the load that leaves no more than the film's {left:g} mm")


def fluid_pressure(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether the skin holds a fluid whose pressure a channel reads."""
    if not isinstance(sensor.skin, FluidBackedShell):
        return _no(NO_FLUID)
    return Reason(True, "an observed channel reads the pressure of the fluid")


def shear(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether an observed channel reads the tangential state of the skin."""
    if not scene.profile.largest_n > 0:
        return _no(NO_LOAD)
    looking = [kind for kind in sensor.reads_shear if kind in scene.observe]
    if not looking:
        return _no("no observed channel looks along the skin")
    slides = "; the slide drags it" if _slides(scene, sensor).called_for else ""
    return Reason(True, f"{' and '.join(looking)} channels look at how a press moves the skin along itself{slides}")


def creep(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a response may lag behind a load that changes.

    The amount depends on the slope of the readings, which only the scene's load table gives: the effect itself decides
    after the skin is solved (`tactbench.rigs.twin.effects.creep`).
    """
    terms = [term for nuisances in _observed(scene, sensor) for term in nuisances.creep]
    share = sum(term.fraction.to("1") for term in terms)
    if not terms or not share:
        return _no("the spec states no creep for the observed channels")
    if scene.drive is not None:
        return Reason(True, f"a motor's force loop may change the load at any rate; {100 * share:.0f} % comes late")
    profile = scene.profile
    if len(set(profile.corners[1])) == 1:
        return _no(f"the load is constant: {profile.corners[1][0]:g} N throughout")
    slowest = max(term.tau.to("s") for term in terms)
    late = f"{100 * share:.0f} % of the response comes late, by up to {slowest:g} s"
    return Reason(True, f"{late}; left out if that is below a third of noise and rounding by the scene's load table")


def transduction(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return that the observed channels read the skin."""
    return Reason(True, f"{sensor.principle} channels read the skin")


# Units, levels, drift, noise.


def gain(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether channels of one unit have different gains."""
    scatter = _largest(scene, sensor, "gain_scatter")
    unit = None if scene.first_unit else _largest(scene, sensor, "unit_gain")
    within, between = (0.0 if one is None else one.to("1") for one in (scatter, unit))
    if not within and not between:
        return _no("the spec states no scatter of gain for the observed channels")
    other = f", and unit {scene.unit} by {100 * between:g} % as a whole" if between else ""
    return Reason(True, f"gains scatter by {100 * within:g} % within a unit{other}")


def unit_rest(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether another unit rests at other levels than the spec states."""
    if scene.first_unit:
        return _no("unit 1 is the one that the spec describes")
    largest = _largest(scene, sensor, "unit_rest_shared", "unit_rest_own")
    if largest is None or not largest.value:
        return _no("the spec states no spread of rest levels from unit to unit")
    return Reason(True, f"levels of unit {scene.unit} differ by {largest} (sd)", largest.value, largest.unit)


def rest_spread(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether channels of one unit rest at different levels."""
    spread = sensor.parameters.get("rest_spread")
    if spread is None or not spread.value:
        return _no("the spec states rest levels channel by channel")
    return Reason(True, f"rest levels scatter by {spread} within a unit", spread.value, spread.unit)


def offset(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether recordings start from different levels."""
    environment, session = scene.environment, _largest(scene, sensor, "offset_session")
    if session is not None and session.value and environment.session_offset_scale:
        return _scaled(environment.session_offset_scale, session, "offset", "levels move by {} (sd) between sessions")
    largest = _largest(scene, sensor, "offset_shared", "offset_own")
    text = "levels move by {} (sd) between recordings; between sessions by nothing more"
    return _scaled(environment.scale_of_offsets, largest, "offset", text)


def warm_up(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether rest levels rise to a warm value."""
    rise, tau = _largest(scene, sensor, "warm_up"), _largest(scene, sensor, "warm_up_tau")
    reason = _scaled(scene.environment.drift_scale, rise, "warm-up", "rest levels rise by {} from power-on")
    if not reason.called_for or tau is None or reason.change is None:
        return reason
    since = scene.environment.since_power_on.to("s") + scene.starts_after_s
    return reason._replace(change=reason.change * math.exp(-since / tau.to("s")))


def wander(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether channels drift freely."""
    spread = _largest(scene, sensor, "wander")
    return _scaled(scene.environment.drift_scale, spread, "free drift", "channels wander by {} (sd)")


def white_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether every sample has its own error."""
    return _scaled(scene.environment.noise_scale, _largest(scene, sensor, "white"), "white noise", "noise of {} (sd)")


def hum(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether dynamic pressure hums at rest."""
    size = sensor.parameters.get("hum")
    if "ac_pressure" not in scene.observe:
        return _no("no channel of dynamic pressure is observed")
    if size is None or not size.value:
        return _no("the spec states no hum")
    scale = scene.environment.noise_scale
    if not scale:
        return _no("the scene scales noise by 0")
    low, high = sensor.parameters["hum_low"], sensor.parameters["hum_high"]
    return Reason(True, f"{size} rms between {low} and {high}, scaled by {scale:g}", scale * size.value)


def converter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return that readings are always stored through the converter."""
    step = _largest(scene, sensor, "step")
    stated = f"steps of {step}, " if step is not None and step.value else ""
    half = None if step is None else step.value / 2
    return Reason(True, f"{stated}clipped to each channel's range", half)


def force_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether the reference force differs from the true one."""
    noise = scene.environment.force_noise
    if not noise.value:
        return _no("the scene's force sensor is free of noise", "N")
    return Reason(True, f"the unfiltered force sensor errs by {noise} (sd)", noise.to("N"), "N")


def force_filter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether the reference force is recorded behind a low-pass."""
    cutoff = scene.environment.force_filter
    if cutoff is None:
        return _no("the force is recorded unfiltered: no cut-off, 0 N off", "N")
    return Reason(True, f"recorded behind a low-pass at {cutoff}", None, "N")


# Sliding.


def _slides(scene: Scene, sensor: SensorSpec) -> Reason:
    slide = scene.slide
    if slide is None:
        return _no("no tangential motion: the scene does not slide")
    if not scene.profile.largest_n > 0:
        return _no(NO_LOAD)
    late = slide.start.to("s") - scene.profile.duration.to("s")
    if late >= 0:
        return _no(f"the slide would start {late:g} s after the recording's end")
    return Reason(True, f"slides at {slide} under up to {scene.profile.largest_n:g} N")


def friction(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether something moves over the skin under a load."""
    found = _slides(scene, sensor)
    if not found.called_for or scene.slide is None:
        return found
    static, kinetic = scene.slide.surface.static_friction.to("1"), scene.slide.surface.kinetic_friction.to("1")
    return found._replace(text=f"{found.text}; friction {static:g} to {kinetic:g}")


def skin_vibration(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a slide over a rough surface makes the skin vibrate."""
    found = _slides(scene, sensor)
    if not found.called_for or scene.slide is None:
        return found
    surface = scene.slide.surface
    per_s = scene.slide.speed.to("mm/s") / surface.roll_off.to("mm")
    return found._replace(text=f"a profile of {surface.roughness} rms passes, its spectrum even up to {per_s:g} Hz")


def ac_pressure(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a channel of dynamic fluid pressure is observed."""
    if "ac_pressure" not in scene.observe:
        return _no("no channel of dynamic pressure is observed")
    if not isinstance(sensor.skin, FluidBackedShell):
        return _no(NO_FLUID)
    bands = [str(channel.band) for channel in sensor.channels("ac_pressure") if channel.band is not None]
    if not bands:
        return _no("no channel of dynamic pressure states its band")
    return Reason(True, f"the fluid's pressure within {bands[0]}")


# Heat: bounds in counts, without numerics on the skin.


def dc_temperature(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a channel of a thermistor that the spec describes is observed."""
    return _thermistor(scene, sensor, "dc_temperature", THERMISTOR)


def ac_temperature(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a channel of the rate of such a thermistor is observed."""
    return _thermistor(scene, sensor, "ac_temperature", (*THERMISTOR, "thermal_high_pass", "thermal_gain"))


def _thermistor(scene: Scene, sensor: SensorSpec, kind: ChannelKind, needed: tuple[str, ...]) -> Reason:
    if kind not in scene.observe:
        return _no(NOT_OBSERVED)
    missing = [name for name in (*needed, *NEEDED) if name not in sensor.parameters]
    if missing:
        return _no(f"the spec states no {', '.join(missing)}")
    rise = sensor.parameters["heater_power"].to("W") * sensor.parameters["heat_resistance"].to("K/W")
    return Reason(True, f"an observed channel reads a core that its heater keeps {rise:.0f} K above the room")


def contact_heat(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether a contact warms or cools the core by more than an observed channel would hide.

    Behind a contact of conductance G the core follows the indenter, D kelvin away, by at most ``D G t / C`` and never
    by more than D. G is at most that of a contact whose whole load stands as far out as the cap or the sheet allows.
    """
    observed = [kind for kind in _HEATED if kind in scene.observe]
    silent = NOT_OBSERVED if not observed else _no_heat(scene, sensor)
    if silent is not None:
        return _no(silent)
    most_k, indenter = _most_k(scene, sensor), scene.environment.indenter_temperature
    counts = {kind: _counts_per_k(kind, scene, sensor) * most_k for kind in observed}
    text = (
        f"indenter at {indenter} on a core of {_ends_c(scene, sensor)[0]:.1f} degC, "
        f"{_difference_k(scene, sensor):.2g} K apart: the core moves by at most {most_k:.2g} K, "
        f"a reading by {max(counts.values()):.2g} counts"
    )
    return _above_the_noise(counts, text, scene, sensor)


def thermal_drift(scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether resistive channels follow a core that the contact warms or cools."""
    if "taxel" not in scene.observe:
        return _no(NOT_OBSERVED)
    if "conductivity_coefficient" not in sensor.parameters:
        return _no("the spec states no coefficient of a fluid's conductivity")
    silent = _no_heat(scene, sensor)
    if silent is not None:
        return _no(silent)
    most = _counts_per_k("taxel", scene, sensor) * _most_k(scene, sensor)
    per_k = 100 * sensor.parameters["conductivity_coefficient"].to("1/K")
    text = f"conductivity changes by {per_k:g} % of that at 25 degC per kelvin: at most {most:.2g} counts"
    return _above_the_noise({"taxel": most}, text, scene, sensor)


def _above_the_noise(counts: dict[ChannelKind, float], text: str, scene: Scene, sensor: SensorSpec) -> Reason:
    """Return whether any kind of channel may move by more than a third of its noise and rounding."""
    scale, stated = scene.environment.noise_scale, sensor.nuisances
    hidden = {kind: stated[kind].hidden(scale) if kind in stated else 0.0 for kind in counts}
    most = max(counts.values())
    if all(count <= hidden[kind] / 3 for kind, count in counts.items()):
        least = min(hidden.values())
        return Reason(False, f"{text}, below a third of noise and rounding ({least:.2g})", most)
    return Reason(True, text, most)


def _no_heat(scene: Scene, sensor: SensorSpec) -> str | None:
    """Return the reason why no heat can flow through the contact, or None."""
    missing = [name for name in (*NEEDED, "contact_conductivity") if name not in sensor.parameters]
    if missing:
        return f"the spec states no {', '.join(missing)}"
    if scene.environment.indenter_temperature is None:
        return "the scene's indenter is as warm as what it touches: 0 K apart"
    return None if scene.profile.largest_n > 0 else NO_LOAD


def _ends_c(scene: Scene, sensor: SensorSpec) -> tuple[float, float]:
    """Return the temperature of the untouched core at the scene's first and last moment: it moves one way only."""
    core = HeatedCore.of(scene, sensor)
    if core is None:
        return 25.0, 25.0
    first, last = core.untouched(scene, np.array([0.0, scene.profile.duration.to("s")]))
    return float(first), float(last)


def _difference_k(scene: Scene, sensor: SensorSpec) -> float:
    indenter = scene.environment.indenter_temperature
    return 0.0 if indenter is None else max(abs(end - indenter.to("degC")) for end in _ends_c(scene, sensor))


def widest_contact_mm(scene: Scene, sheet: SkinSheet) -> float:
    """Return an upper bound on the radius of a contact, mm.

    It is sqrt(5/2) times the rms distance of the load from the apex. None of it stands beyond the sheet's other corner,
    nor beyond a cap's rim, which along the arc is at most pi/2 times as far as straight.
    """
    farthest = math.hypot(sheet.x_max.to("mm") - sheet.x_min.to("mm"), sheet.arc.to("mm"))
    if scene.indenter.radius is not None:
        farthest = min(farthest, math.pi / 2 * scene.indenter.radius.to("mm"))
    return math.sqrt(5 / 2) * farthest


def _most_k(scene: Scene, sensor: SensorSpec) -> float:
    if sensor.skin is None:
        return 0.0
    widest = widest_contact_mm(scene, sensor.skin.sheet)
    conductance = 4e-3 * sensor.parameters["contact_conductivity"].to("W/m/K") * widest
    profile = scene.profile
    # A force loop touches the skin while it waits, too.
    idle = 0.0 if profile.corners[1][0] > 0 or scene.drive is not None else profile.hold_s
    pressed_s = max(profile.duration.to("s") - idle, 0.0)
    share = min(1.0, conductance * pressed_s / sensor.parameters["heat_capacity"].to("J/K"))
    return _difference_k(scene, sensor) * share


def _counts_per_k(kind: ChannelKind, scene: Scene, sensor: SensorSpec) -> float:
    """Return an upper bound on the change of a reading of `kind` per kelvin of the core, in counts."""
    top = max(channel.upper or 1.0 for channel in sensor.channels(kind))
    if kind == "taxel":
        coefficient = sensor.parameters.get("conductivity_coefficient")
        if coefficient is None:
            return 0.0
        # d reading / d ln(conductivity) = top r/(1 + r)^2 <= top/4; relative to 25 degC, so most where it is coldest.
        indenter, per_k = scene.environment.indenter_temperature, coefficient.to("1/K")
        coldest = min(*_ends_c(scene, sensor), 25.0 if indenter is None else indenter.to("degC"))
        return top / 4 * per_k / max(1.0 + per_k * (coldest - 25.0), 0.1)
    if "thermistor_b" not in sensor.parameters:
        return 0.0
    # x = p/(exp(b/T) + q): d x / d T = x (1 - x q/p) b/T^2 <= p/(4 q) b/T^2; nothing is colder than 250 K here.
    p, q, b = (sensor.parameters[f"thermistor_{name}"].value for name in "pqb")
    slope = top * p / (4 * q) * b / 250.0**2
    if kind == "dc_temperature":
        return slope
    gain = sensor.parameters.get("thermal_gain")
    # The high-pass gives its input less a mean of its past: at most the input's whole range.
    return 0.0 if gain is None else slope * gain.to("1")
