"""Whether a scene calls for friction, shear, vibration and dynamic pressure: predicates without numerics."""

from __future__ import annotations

from tactbench.plugin import Scene, SensorSpec
from tactbench.plugin.simulation import FluidBackedShell, Reason

STILL = "no tangential motion: the scene does not slide"
UNSEEN = "no channel of dynamic pressure is observed"


def _slides(scene: Scene, sensor: SensorSpec) -> Reason:
    slide = scene.slide
    if slide is None:
        return Reason(False, STILL, 0.0)
    if sensor.skin is None:
        return Reason(False, f"{sensor.name} declares no skin", 0.0)
    largest = scene.profile.largest_n
    if not largest > 0:
        return Reason(False, "the scene has no load: 0 N throughout", 0.0)
    late = slide.start.to("s") - scene.profile.duration.to("s")
    if late >= 0:
        return Reason(False, f"the slide would start {late:g} s after the recording's end", 0.0)
    return Reason(True, f"slides at {slide} under up to {largest:g} N")


def friction(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether something moves over the skin under a load."""
    found = _slides(scene, sensor)
    if not found.called_for or scene.slide is None:
        return found
    surface = scene.slide.surface
    return found._replace(
        text=f"{found.text}; friction {surface.static_friction.to('1'):g} to {surface.kinetic_friction.to('1'):g}"
    )


def shear(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether an observed channel looks at what the skin does along itself."""
    if sensor.skin is None:
        return Reason(False, f"{sensor.name} declares no skin", 0.0)
    if not scene.profile.largest_n > 0:
        return Reason(False, "the scene has no load: 0 N throughout", 0.0)
    looking = [kind for kind in sensor.reads_shear if kind in scene.observe]
    if not looking:
        return Reason(False, "no observed channel looks along the skin", 0.0)
    slides = "; the slide drags it" if _slides(scene, sensor).called_for else ""
    return Reason(True, f"{' and '.join(looking)} channels look at how a press moves the skin along itself{slides}")


def skin_vibration(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether slip shakes the skin."""
    found = _slides(scene, sensor)
    if not found.called_for or scene.slide is None:
        return found
    surface = scene.slide.surface
    per_s = scene.slide.speed.to("mm/s") / surface.roll_off.to("mm")
    return found._replace(text=f"a profile of {surface.roughness} rms passes, its spectrum even up to {per_s:g} Hz")


def ac_pressure(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether somebody looks at what a band lets through of a fluid's pressure."""
    if "ac_pressure" not in scene.observe:
        return Reason(False, UNSEEN, 0.0)
    if not isinstance(sensor.skin, FluidBackedShell):
        return Reason(False, "the skin holds no fluid", 0.0)
    bands = [str(channel.band) for channel in sensor.channels("ac_pressure") if channel.band is not None]
    if not bands:
        return Reason(False, "no channel of dynamic pressure states its band", 0.0)
    return Reason(True, f"the fluid's pressure within {bands[0]}")


def hum(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether dynamic pressure hums at rest."""
    size = sensor.parameters.get("hum")
    if "ac_pressure" not in scene.observe:
        return Reason(False, UNSEEN, 0.0)
    if size is None or not size.value:
        return Reason(False, "the spec states no hum", 0.0)
    if not scene.environment.noise_scale:
        return Reason(False, "the scene scales noise by 0", 0.0)
    low, high = sensor.parameters["hum_low"], sensor.parameters["hum_high"]
    scale = scene.environment.noise_scale
    text = f"{size} rms between {low} and {high}, scaled by {scale:g}"
    return Reason(True, text, scale * size.value)
