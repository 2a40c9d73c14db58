"""Which effects a scene calls for: predicates without numerics, so that a plan costs nothing.

Each takes the scene and the sensor's spec and answers with a Reason that carries a number where there is one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from tactbench.plugin import Quantity, Scene, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, Nuisances, Reason


def _observed(scene: Scene, sensor: SensorSpec) -> list[Nuisances]:
    return [sensor.nuisances[kind] for kind in scene.observe if kind in sensor.nuisances]


def _largest(scene: Scene, sensor: SensorSpec, pick: Callable[[Nuisances], Quantity]) -> Quantity | None:
    found = [pick(nuisances) for nuisances in _observed(scene, sensor)]
    return max(found, key=lambda quantity: quantity.value, default=None)


def contact(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether the skin is pressed."""
    largest = scene.profile.largest_n
    if sensor.skin is None:
        return Reason(False, f"{sensor.name} declares no skin", 0.0)
    if not largest > 0:
        return Reason(False, "the scene has no load: 0 N throughout", 0.0)
    return Reason(True, f"{scene.indenter} pressed with up to {largest:g} N")


def core(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether the skin may touch down on a core."""
    if not isinstance(sensor.skin, FluidBackedShell):
        return Reason(False, "the skin has no core under a fluid film", 0.0)
    if not scene.profile.largest_n > 0:
        return Reason(False, "the scene has no load: 0 N throughout", 0.0)
    left = sensor.skin.film.most_mm - sensor.skin.residual_film.to("mm")
    return Reason(True, f"taken into the solve from the load that leaves no more than the film's {left:g} mm")


def fluid_pressure(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether there is a fluid whose pressure can be looked at."""
    if not isinstance(sensor.skin, FluidBackedShell):
        return Reason(False, "the skin holds no fluid", 0.0)
    return Reason(True, "an observed channel reads the pressure of the fluid")


def transduction(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether the sensor has a skin to read."""
    if sensor.skin is None:
        return Reason(False, f"{sensor.name} declares no skin", 0.0)
    return Reason(True, f"{sensor.principle} channels read the skin")


def creep(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether a response may lag behind a load that changes.

    By how much depends on how steep the readings are, and that only the scene's own load table says: creep is settled
    when the skin is solved (`tactbench.rigs.twin.effects.creep`).
    """
    terms = [term for nuisances in _observed(scene, sensor) for term in nuisances.creep]
    share = sum(term.fraction.to("1") for term in terms)
    if not terms or not share:
        return Reason(False, "the spec states no creep for the observed channels", 0.0)
    if scene.drive is not None:
        return Reason(True, f"a motor's force loop may change the load at any rate; {100 * share:.0f} % comes late")
    profile = scene.profile
    if len(set(profile.corners[1])) == 1:
        return Reason(False, f"the load is constant: {profile.start.to('N'):g} N throughout", 0.0)
    slowest = max(term.tau.to("s") for term in terms)
    late = f"{100 * share:.0f} % of the response comes late, by up to {slowest:g} s"
    return Reason(True, f"{late}; left out if that is below a third of noise and rounding by the scene's load table")


def gain(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether channels of one unit have different gains."""
    scatter = _largest(scene, sensor, lambda nuisances: nuisances.gain_scatter)
    within = 0.0 if scatter is None else scatter.to("1")
    between = max((_unit_gain(scene, nuisances) for nuisances in _observed(scene, sensor)), default=0.0)
    if not within and not between:
        return Reason(False, "the spec states no scatter of gain for the observed channels", 0.0)
    other = f", and unit {scene.unit} by {100 * between:g} % as a whole" if between else ""
    return Reason(True, f"gains scatter by {100 * within:g} % within a unit{other}")


def _unit_gain(scene: Scene, nuisances: Nuisances) -> float:
    """Return the standard deviation of the gain that a unit's channels share; 0 for the unit of the spec."""
    return 0.0 if scene.first_unit or nuisances.unit_gain is None else nuisances.unit_gain.to("1")


def unit_rest(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether another unit rests at other levels than the spec states."""
    if scene.first_unit:
        return Reason(False, "unit 1 is the one that the spec describes", 0.0)
    found = [
        stated
        for nuisances in _observed(scene, sensor)
        for stated in (nuisances.unit_rest_shared, nuisances.unit_rest_own)
        if stated is not None and stated.value
    ]
    if not found:
        return Reason(False, "the spec states no spread of rest levels from unit to unit", 0.0)
    largest = max(found, key=lambda quantity: quantity.value)
    return Reason(True, f"levels of unit {scene.unit} differ by {largest} (sd)", largest.value, largest.unit)


def offset(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether recordings start from different levels."""
    environment = scene.environment
    shared = _largest(scene, sensor, lambda nuisances: nuisances.offset_shared)
    own = _largest(scene, sensor, lambda nuisances: nuisances.offset_own)
    session = _largest(scene, sensor, lambda nuisances: nuisances.offset_session)
    if session is not None and session.value and environment.session_offset_scale:
        scale = environment.session_offset_scale
        moved = f"levels move by {session} (sd) between sessions, scaled by {scale:g}"
        return Reason(True, moved, scale * session.value, session.unit)
    found = [quantity for quantity in (shared, own) if quantity is not None]
    largest = max(found, key=lambda quantity: quantity.value, default=None)
    return _scaled(
        environment.scale_of_offsets,
        largest,
        "offset",
        "levels move by {} (sd) between recordings; between sessions by nothing more",
    )


def warm_up(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether rest levels rise to a warm value."""
    rise = _largest(scene, sensor, lambda nuisances: nuisances.warm_up)
    reason = _scaled(scene.environment.drift_scale, rise, "warm-up", "rest levels rise by {} from power-on")
    tau = _largest(scene, sensor, lambda nuisances: nuisances.warm_up_tau)
    if not reason.called_for or tau is None or reason.change is None:
        return reason
    since = scene.environment.since_power_on.to("s") + scene.starts_after_s
    return reason._replace(change=reason.change * math.exp(-since / tau.to("s")))


def wander(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether channels drift freely."""
    spread = _largest(scene, sensor, lambda nuisances: nuisances.wander)
    return _scaled(scene.environment.drift_scale, spread, "free drift", "channels wander by {} (sd)")


def rest_spread(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether channels of one unit rest at different levels."""
    spread = sensor.parameters.get("rest_spread")
    if spread is None or not spread.value:
        return Reason(False, "the spec states rest levels channel by channel", 0.0)
    return Reason(True, f"rest levels scatter by {spread} within a unit", spread.value, spread.unit)


def white_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether every sample has its own error."""
    noise = _largest(scene, sensor, lambda nuisances: nuisances.white)
    if noise is None or not noise.value:
        return Reason(False, "the spec states no white noise for the observed channels", 0.0)
    if not scene.environment.noise_scale:
        return Reason(False, "the scene scales noise by 0", 0.0)
    scale = scene.environment.noise_scale
    return Reason(True, f"noise of {noise} (sd), scaled by {scale:g}", scale * noise.value, noise.unit)


def converter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer that readings are always stored through the converter."""
    step = _largest(scene, sensor, lambda nuisances: nuisances.step)
    stated = f"steps of {step}, " if step is not None and step.value else ""
    half = None if step is None else step.value / 2
    return Reason(True, f"{stated}clipped to each channel's range", half)


def force_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether the reference force differs from the true one."""
    noise = scene.environment.force_noise
    if not noise.value:
        return Reason(False, "the scene's force sensor is free of noise", 0.0, "N")
    return Reason(True, f"the unfiltered force sensor errs by {noise} (sd)", noise.to("N"), "N")


def _scaled(scale: float, size: Quantity | None, what: str, text: str) -> Reason:
    if size is None or not size.value:
        return Reason(False, f"the spec states no {what} for the observed channels", 0.0)
    if not scale:
        return Reason(False, f"the scene scales {what} by 0", 0.0)
    return Reason(True, f"{text.format(size)}, scaled by {scale:g}", scale * size.value, size.unit)
