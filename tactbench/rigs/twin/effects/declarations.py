"""The effects there are, what they read and write, and when a scene calls for them. Nothing here computes.

The path of a reading: ``force → load → response → readings → samples``; beside it ``force → label``.
"""

from __future__ import annotations

from tactbench.plugin import EffectDescriptor, Nuisances, Scene, SensorSpec

Reason = tuple[bool, str]
"""Whether an effect is called for, and why or why not."""

_HERE = "tactbench.rigs.twin.effects"


def _declare(name: str, title: str, consumes: str, produces: str) -> EffectDescriptor:
    module = name.replace("-", "_")
    return EffectDescriptor(
        name=name, title=title, consumes=(consumes,), produces=(produces,),
        where=f"{_HERE}.{module}:apply", called_for=f"{_HERE}.declarations:{module}",
    )  # fmt: skip


EFFECTS = (
    _declare("creep", "Viscoelastic creep of the skin", "force", "load"),
    _declare("contact", "Normal contact, and the sensor's transduction", "load", "response"),
    _declare("gain-scatter", "Gains that differ from channel to channel of one unit", "response", "response"),
    _declare("rest-level", "Reading with nothing touching", "response", "readings"),
    _declare("offset", "Offsets of a recording, and of a session", "readings", "readings"),
    _declare("warm-up", "Shared drift while the sensor warms up", "readings", "readings"),
    _declare("wander", "Free drift of single channels (Ornstein-Uhlenbeck)", "readings", "readings"),
    _declare("white-noise", "White noise", "readings", "readings"),
    _declare("converter", "Rounding, clipping and the flag of saturation", "readings", "samples"),
    _declare("force-noise", "Noise of the unfiltered force-torque sensor", "force", "label"),
)


def _observed(scene: Scene, sensor: SensorSpec) -> list[Nuisances]:
    return [nuisances for kind, nuisances in sensor.nuisances.items() if kind in scene.observe]


def _largest(scene: Scene, sensor: SensorSpec, *fields: str) -> float:
    return max(
        (getattr(nuisances, field).value for nuisances in _observed(scene, sensor) for field in fields), default=0.0
    )


def creep(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where the skin creeps and the load changes."""
    terms = [term for nuisances in _observed(scene, sensor) for term in nuisances.creep]
    late = max((sum(t.fraction.to("1") for t in n.creep) for n in _observed(scene, sensor)), default=0.0)
    if not terms or late == 0:
        return False, "the sensor states no creep"
    slowest = max(term.tau.to("s") for term in terms)
    duration = scene.profile.duration.to("s")
    return True, f"{late:.0%} of the response arrives late (up to {slowest:g} s; the scene lasts {duration:g} s)"


def contact(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where there is a load."""
    largest = max(scene.profile.start.to("N"), scene.profile.end.to("N"))
    return largest > 0, f"pressed up to {largest:g} N" if largest > 0 else "the scene has no load"


def gain_scatter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where gains differ."""
    scatter = _largest(scene, sensor, "gain_scatter")
    return scatter > 0, f"gains differ by {scatter:.0%}" if scatter > 0 else "the sensor states no scatter of gains"


def rest_level(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it always: a reading has a level."""
    return True, "every reading has one"


def offset(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where recordings differ in level."""
    within = scene.environment.drift_scale * _largest(scene, sensor, "offset_shared", "offset_own")
    between = scene.environment.session_offset_scale * _largest(scene, sensor, "offset_session")
    if within == 0 and between == 0:
        return False, "no offsets stated, or scaled to nothing"
    return True, f"up to {within:g} counts (sd) between recordings, {between:g} between sessions"


def warm_up(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where the sensor is not yet warm."""
    environment = scene.environment
    amplitude = environment.drift_scale * _largest(scene, sensor, "warm_up")
    if amplitude == 0:
        return False, "the sensor states no warm-up, or it is scaled to nothing"
    since = environment.since_power_on.to("s") + scene.starts_after_s
    tau = max(nuisances.warm_up_tau.to("s") for nuisances in _observed(scene, sensor))
    return True, f"{amplitude:g} counts with {tau:g} s, {since:g} s after power-on"


def wander(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where single channels drift."""
    size = scene.environment.drift_scale * _largest(scene, sensor, "wander")
    return size > 0, f"{size:g} counts (sd)" if size > 0 else "no free drift stated, or scaled to nothing"


def white_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where channels are noisy."""
    size = scene.environment.noise_scale * _largest(scene, sensor, "white")
    return size > 0, f"{size:g} counts (sd)" if size > 0 else "no noise stated, or scaled to nothing"


def converter(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it always: samples leave through it."""
    step = _largest(scene, sensor, "step")
    return True, f"steps of {step:g}" if step else "no steps, only the converter's range"


def force_noise(scene: Scene, sensor: SensorSpec) -> Reason:
    """Call for it where the reference is noisy."""
    noise = scene.environment.force_noise.to("N")
    return noise > 0, f"{noise:g} N (sd), unfiltered" if noise > 0 else "the reference is free of noise"
