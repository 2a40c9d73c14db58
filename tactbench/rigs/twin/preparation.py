"""Preparation of a simulated recording (clocks, load, place of contact) and application of its plan."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from pydantic import BaseModel

from tactbench.plugin import (
    FloatArray,
    IndenterDescriptor,
    Quantity,
    RigError,
    Scene,
    SensorDescriptor,
    SensorSpec,
)
from tactbench.rigs.twin.fidelity import DEFAULT, Fidelity, rung
from tactbench.rigs.twin.geometry import Contact, radius_mm, shape_of
from tactbench.rigs.twin.planner import Plan
from tactbench.rigs.twin.synthesis import Load, Synthesis, Track

_OWN_CLOCK_FROM = 2.0
"""Ratio of a stream's rate to the sensor's slowest rate from which the stream is simulated on its own clock."""
MOST_SAMPLES = 20_000_000
"""Largest number of samples in a stream: two and a half hours at 2200 Hz, 160 MB per channel and effect."""
_NOT_BELOW_ZERO = (
    "scatter", "tilt_scatter", "start", "end", "hold", "since_power_on", "force_noise",
    "proportional", "integral", "delay", "motor_lag", "resolution",
)  # fmt: skip
"""Names of the fields of a scene and its force loop that must not be negative."""
_ABOVE_ZERO = ("duration", "force_filter", "cutoff", "rate", "speed", "acceleration")
"""Names of the fields of a scene that must be above 0."""


def prepare(
    sensor: SensorDescriptor,
    scene: Scene,
    seed: int,
    plan: Plan,
    fidelity: Fidelity = DEFAULT,
    indenters: Sequence[IndenterDescriptor] = (),
) -> Synthesis:
    """Return the recording of `scene` before any effect is applied; `indenters` are the shapes that a scene may name.

    Raises
    ------
    RigError
        If a number of the scene is not valid, a stream has too many samples, or the indenter's shape is not installed.
    UsageError
        If the scene gives a dimension that the shape does not have.
    NotApplicable
        If the sensor does not have the scenario named in the scene's simulation.
    """
    check_numbers(scene)
    sensor = handled(sensor, scene)
    profile = scene.profile
    t_s: FloatArray = np.arange(profile.samples, dtype=np.float64) * (profile.duration.to("s") / profile.samples)
    load = Load(*(np.array(corner) for corner in profile.corners))
    run = Synthesis(
        sensor=sensor,
        scene=scene,
        seed=seed,
        t_s=t_s,
        load=load,
        tracks=tuple(_tracks(sensor.spec, scene, plan, t_s, load)),
        contact=Contact(radius_mm(scene.indenter), 0.0, 0.0, shape=shape_of(scene.indenter, indenters)),
        reference_n=load.at(t_s),
        lent=plan.lent,
        forced=frozenset(entry.effect for entry in plan.entries if entry.asked and entry.included),
        fidelity=fidelity if scene.simulation.rung is None else rung(scene.simulation.rung),
    )
    run.contact = _place(run)
    return run


def handled(sensor: SensorDescriptor, scene: Scene) -> SensorDescriptor:
    """Return the sensor with the scene's scenario and nuisances; raises NotApplicable for an unknown scenario."""
    own = scene.simulation
    if own.scenario is None and not own.nuisances:
        return sensor
    spec = sensor.spec.handled(own.scenario).with_nuisances(dict(own.nuisances))
    return sensor.model_copy(update={"spec": spec})


def carried_out(
    sensor: SensorDescriptor,
    scene: Scene,
    seed: int,
    plan: Plan,
    fidelity: Fidelity = DEFAULT,
    indenters: Sequence[IndenterDescriptor] = (),
) -> Synthesis:
    """Return the recording of `scene` with every effect of its plan applied; raises the errors of the effects."""
    run = prepare(sensor, scene, seed, plan, fidelity, indenters)
    for effect in plan.stages:
        run.apply(effect)
    return run


def _tracks(spec: SensorSpec, scene: Scene, plan: Plan, t_s: FloatArray, load: Load) -> Iterator[Track]:
    """Yield the channels on the reference clock, followed by the channels of each stream with its own clock.

    In a scene that slides, where moments matter, no stream is sampled faster than by the real sensor.
    """
    duration = scene.profile.duration.to("s")
    slowest = min((stream.rate_hz for stream in spec.streams if stream.rate_hz is not None), default=math.inf)
    at_least = 0.0 if scene.slide is None else scene.profile.samples / duration
    slow = tuple(
        stream
        for stream in spec.streams
        if stream.rate_hz is None or at_least <= stream.rate_hz < _OWN_CLOCK_FROM * slowest
    )
    for clock, streams in (("", slow), *((stream.name, (stream,)) for stream in spec.streams if stream not in slow)):
        kept = tuple(
            stream.model_copy(update={"channels": wanted})
            for stream in streams
            if (wanted := tuple(channel for channel in stream.channels if channel.kind in plan.kinds))
        )
        if not kept:
            continue
        channels = tuple(channel for stream in kept for channel in stream.channels)
        rate = streams[0].rate_hz if clock else None
        if rate is not None and not duration * rate <= MOST_SAMPLES:
            raise RigError(
                f"The stream {clock} would have {duration * rate:.2g} samples: {duration:g} s at {rate:g} Hz.",
                hint=f"At most {MOST_SAMPLES} are allowed: shorten the scene, or observe slower channels.",
            )
        own = t_s if rate is None else np.arange(math.ceil(duration * rate), dtype=np.float64) / rate
        yield Track(
            clock=clock,
            streams=kept,
            channels=channels,
            t_s=own,
            force_n=load.at(own),
            readings=np.tile([0.0 if one.rest is None else one.rest.to(one.unit) for one in channels], (own.size, 1)),
            quality=np.zeros((own.size, len(channels)), dtype=np.uint8),
        )


def _place(run: Synthesis) -> Contact:
    """Return the indenter's place on the skin: nominal point, commanded offset, and this mounting's random error."""
    placement = run.scene.placement
    commanded_x, commanded_s = commanded_place_mm(run.sensor.spec, run.scene)
    draws = run.of_recording("placement").standard_normal(4).tolist()
    scatter, tilt_scatter = placement.scatter.to("mm"), placement.tilt_scatter.to("rad")
    x, s = commanded_x + scatter * draws[0], commanded_s + scatter * draws[1]
    run.drawn.update(placed_x_mm=x, placed_s_mm=s)
    angle_x = placement.tilt_x.to("rad") + tilt_scatter * draws[2]
    angle_s = placement.tilt_s.to("rad") + tilt_scatter * draws[3]
    if tilt_scatter:
        run.drawn.update(tilted_x_deg=math.degrees(angle_x), tilted_s_deg=math.degrees(angle_s))
    return replace(run.contact, x_mm=x, s_mm=s, tilt_x=math.tan(angle_x), tilt_s=math.tan(angle_s))


def commanded_place_mm(spec: SensorSpec, scene: Scene) -> tuple[float, float]:
    """Return the commanded place (x, s) of the indenter's apex on the skin: nominal point plus the scene's offset."""
    assert spec.skin is not None  # a scene is planned before it is prepared
    sheet, placement = spec.skin.sheet, scene.placement
    x, s = (spec.parameters.get(f"contact_{axis}") for axis in "xs")
    nominal_x = (sheet.x_min.to("mm") + sheet.x_max.to("mm")) / 2 if x is None else x.to("mm")
    return nominal_x + placement.x.to("mm"), (0.0 if s is None else s.to("mm")) + placement.s.to("mm")


def check_numbers(scene: Scene) -> None:
    """Raise an error for a scene with a number that is not finite or is out of its field's range.

    A radius may be infinite, for a flat surface.

    Raises
    ------
    RigError
        If a number is not allowed; the message names the field.
    """
    samples = scene.profile.samples
    if samples > MOST_SAMPLES:
        raise RigError(
            f"Scene {scene.name!r} has {samples} samples; at most {MOST_SAMPLES} are allowed.",
            hint="Divide it into several shorter scenes.",
        )
    for name, value, text in _numbers(scene, ()):
        positive = name[-1] in _ABOVE_ZERO
        signed = not positive and name[-1] not in _NOT_BELOW_ZERO
        flat = name[-1] == "radius" and value == math.inf
        if not (math.isfinite(value) or flat) or (value < 0 and not signed) or (value == 0 and positive):
            raise RigError(
                f"The {' '.join(name).replace('_', ' ')} of scene {scene.name!r} is {text}.",
                hint="Give a finite number" + ("." if signed else ", above zero." if positive else ", not below zero."),
            )


def _numbers(model: BaseModel, above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], float, str]]:
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantity):
            yield (*above, name), value.value, str(value)
        elif isinstance(value, float):
            yield (*above, name), value, f"{value:g}"
        elif isinstance(value, BaseModel):
            yield from _numbers(value, (*above, name))
