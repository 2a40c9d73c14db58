"""Plan of a simulated recording (effects in order, with a reason for each), its preparation and its application.

Effects name the tokens (results) that they produce and consume. Tokens observed by the scene are needed. An effect that
produces a needed token is included if its own decision function or the scene includes it; then the tokens that it
consumes are needed, too. No other effect is imported or applied.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import BaseModel

from tactbench.plugin import (
    ChannelKind,
    FloatArray,
    IndenterDescriptor,
    NotApplicable,
    PlanEntry,
    PluginContractError,
    Quantity,
    RigError,
    Scene,
    SensorDescriptor,
    SensorSpec,
    UsageError,
    load_object,
)
from tactbench.plugin.simulation import EffectDescriptor, Reason
from tactbench.rigs.twin.effects.called_for import NOT_OBSERVED
from tactbench.rigs.twin.geometry import Contact, shape_of
from tactbench.rigs.twin.synthesis import DEFAULT, Fidelity, Load, Settled, Synthesis, Track, rung

STORED = "stored"
"""Name of the result "stored samples", which every recording needs."""
REFERENCE = "reference-force"
"""Name of the result "reference force", which every recording needs."""
LENT = ("core", "fluid-pressure", "shear")
"""Names of the effects that the contact solver itself applies, or applies when a load needs them."""


@dataclass(frozen=True)
class Plan:
    """Effects that simulate one scene, in order, with the reasons for and against each."""

    kinds: tuple[ChannelKind, ...]
    """Kinds of channels that will be recorded."""
    entries: tuple[PlanEntry, ...]
    """Included effects in the order of application, followed by the effects left out."""
    stages: tuple[EffectDescriptor, ...]
    """Descriptors of the effects to apply, in order."""
    lent: frozenset[str]
    """Names of the included effects that the contact solver applies."""

    def settled(self, decided: Mapping[str, Settled]) -> tuple[PlanEntry, ...]:
        """Return the entries, after replacing those that could be decided only after the contact was solved."""
        entries = [
            entry.model_copy(update=decided[entry.effect]._asdict()) if entry.effect in decided else entry
            for entry in self.entries
        ]
        return tuple(sorted(entries, key=lambda entry: not entry.included))


def plan_scene(effects: Sequence[EffectDescriptor], scene: Scene, sensor: SensorSpec) -> Plan:
    """Return the plan of one scene with one sensor.

    Raises
    ------
    NotApplicable
        If the sensor has no channel of the observed kinds, or no included effect computes an observed kind.
    """
    kinds = _observed(scene, sensor)
    signed = _signed(effects, scene)
    reasons = _needed(effects, {*kinds, STORED, REFERENCE}, signed, scene, sensor)
    included: list[EffectDescriptor] = []
    entries: dict[str, PlanEntry] = {}
    for effect in effects:
        reason = reasons[effect.name]
        taken = signed.get(effect.name, reason.called_for)
        if taken:
            included.append(effect)
        asked, text, change = effect.name in signed, reason.text, reason.change
        if asked and (taken or reason.called_for):
            text = f"{'included' if taken else 'left out'} by the scene; without its statement: {text}"
        if reason.called_for and not taken:
            change = None  # what an effect would have changed that was called for is no bound any more
        entries[effect.name] = PlanEntry(
            effect=effect.name, included=taken, reason=text, change=change, unit=reason.unit, asked=asked
        )
    for kind in kinds:
        if not any(kind in effect.produces for effect in included):
            without = [name for name, taken in signed.items() if not taken]
            raise NotApplicable(
                f"The twin does not model {kind} of {sensor.name}: no installed effect produces it in this scene"
                + (f" without {', '.join(without)}." if without else "."),
                hint="Record or replay a real sensor, or install a plugin with an effect for this kind.",
            )
    ordered = _ordered(included)
    left_out = [effect for effect in effects if effect not in included]
    return Plan(
        kinds=kinds,
        entries=tuple(entries[effect.name] for effect in (*ordered, *left_out)),
        stages=tuple(effect for effect in ordered if effect.name not in LENT),
        lent=frozenset(effect.name for effect in ordered).intersection(LENT),
    )


def _signed(effects: Sequence[EffectDescriptor], scene: Scene) -> dict[str, bool]:
    """Return the effects that the scene includes (True) or leaves out (False) by name; later words override earlier.

    Raises
    ------
    UsageError
        If a word is neither an effect, nor a group of effects, nor ``all``.
    """
    signed: dict[str, bool] = {}
    for word in scene.simulation.effects:
        name = word.lstrip("+-")
        meant = [effect.name for effect in effects if name in (effect.name, *effect.groups, "all")]
        if not meant:
            groups = sorted({group for effect in effects for group in effect.groups} | {"all"})
            raise UsageError(
                f"The word {word!r} of the scene's effects names {name!r}, which is not an installed effect.",
                hint=f"Effects: {', '.join(effect.name for effect in effects)}. Groups: {', '.join(groups)}.",
            )
        for found in meant:
            signed.pop(found, None)
            if word != name:
                signed[found] = word.startswith("+")
    return signed


def _observed(scene: Scene, sensor: SensorSpec) -> tuple[ChannelKind, ...]:
    present = {channel.kind for channel in sensor.channels()}
    kinds = tuple(dict.fromkeys(kind for kind in scene.observe if kind in present))
    if not kinds:
        raise NotApplicable(
            f"The scene needs a channel of kind {' or '.join(scene.observe) or '(no kind given)'}; {sensor.name} has "
            f"{', '.join(sorted(present))}."
        )
    return kinds


def _needed(
    effects: Sequence[EffectDescriptor], tokens: set[str], signed: Mapping[str, bool], scene: Scene, sensor: SensorSpec
) -> dict[str, Reason]:
    """Return the reasons to include or leave out each effect, by the effect's name.

    Only an included effect makes the tokens that it consumes needed.
    """
    reasons: dict[str, Reason] = {}
    for effect in effects:
        reasons[effect.name] = reason = load_object(effect.called_for)(scene, sensor)
        if not isinstance(reason, Reason):
            raise PluginContractError(
                f"{effect.called_for} of effect {effect.name} returned {type(reason).__name__}, not Reason.",
                hint="Return tactbench.plugin.Reason(called_for, text).",
            )
    taking = [effect for effect in effects if signed.get(effect.name, reasons[effect.name].called_for)]
    needed = tokens.union(*(effect.produces for effect in effects if signed.get(effect.name)))
    before: set[str] = set()
    while needed != before:
        before = needed
        needed = needed.union(*(effect.consumes for effect in taking if needed.intersection(effect.produces)))
    for effect in taking:
        if not needed.intersection(effect.produces):
            reasons[effect.name] = Reason(False, NOT_OBSERVED, 0.0)
    return reasons


def _ordered(effects: Sequence[EffectDescriptor]) -> list[EffectDescriptor]:
    """Return effects sorted such that a producer precedes its consumers, otherwise in the order given."""
    waiting, done = list(effects), []
    while waiting:
        for effect in waiting:
            others = [other for other in waiting if other is not effect]
            if not any(set(effect.consumes).intersection(other.produces) for other in others):
                break
        else:
            names = ", ".join(effect.name for effect in waiting)
            raise PluginContractError(
                f"The effects {names} consume each other's results in a circle, so that none can be first.",
                hint="Correct `produces` and `consumes` in their descriptors.",
            )
        waiting.remove(effect)
        done.append(effect)
    return done


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
        contact=Contact(
            math.inf if scene.indenter.radius is None else scene.indenter.radius.to("mm"),
            0.0,
            0.0,
            shape=shape_of(scene.indenter, indenters),
        ),
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
