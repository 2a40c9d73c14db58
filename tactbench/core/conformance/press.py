"""Checks that record a small press on a simulated rig and read it back, for every kind of plugin in it."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any, get_args

import numpy as np

from tactbench.core.conformance.check import CheckFailed, CheckSkipped, Subject, check, code_of, fail, skip
from tactbench.core.conformance.recorded import fits
from tactbench.core.conformance.streams import (
    FORCE_SHARE,
    Recorded,
    carried_out,
    differing,
    force_is,
    pressing_force,
    times_are_right,
)
from tactbench.core.errors import UsageError
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.rigs import force_path, rig_context
from tactbench.core.samples import FloatArray, Quality
from tactbench.core.spec import units
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Environment, ForceLoop, Indenter, Scene, Simulation, Slide
from tactbench.core.spec.sensor import ChannelKind

FORCE_N, EFFECT_N = 0.5, 2.0  # every sensor bears the first; effects need load
TASK_N = 5.0  # the range of our tasks of force
NOISE_N = 0.005  # of the reference: a hundredth of the press, so that draws differ visibly
SECONDS, LATE = 1.0, 0.5  # duration of a press; share by which a rig that begins later may deviate from it
LEAST_RISE = 0.02  # of its whole change, in the upper part of a channel's range (assumed: foams harden)
ALWAYS_WANTED = ("stored", "reference-force")  # tokens that every recording needs, beside the kinds of channels
READINGS = frozenset((*get_args(ChannelKind), "disturbance", "reading", "stored"))  # tokens that change only readings
REACH_MM, FLAT = 15.0, 2e-3  # half-width of the examined square; share of its largest dimension by which a body rises
LOWEST_MM = 1e-9  # rounding of the lowest point, which is at 0
CALLS = 8  # calls of `called_for` for one scene: a random answer then shows
MOST_N = 100.0  # beyond the rated range of every tactile sensor of a finger
WHY = "a check of plugins"


def tiny_scene(end_n: float = FORCE_N, **changes: Any) -> Scene:
    """Return a scene of a press of one second, by default to 0.5 N, with `changes` to the scene's fields."""
    end, hold, duration = assumed(end_n, "N", WHY), assumed(SECONDS / 5, "s", WHY), assumed(SECONDS, "s", WHY)
    ramp = ForceRamp(end=end, hold=hold, duration=duration, samples=100)
    environment = Environment(force_noise=assumed(NOISE_N, "N", WHY))
    return Scene(name="check", profile=ramp, environment=environment).model_copy(update=changes)


def simulated_rig(subject: Subject) -> tuple[Any, RigDescriptor]:
    """Return the first simulated rig, built; rigs of tactbench come first."""
    descriptor = subject.registry.rigs[subject.registry.first_rig("simulated")]
    return load_object(descriptor.where)(rig_context(subject.registry)), descriptor


def simulated_sensors(subject: Subject) -> Sequence[SensorDescriptor]:
    """Return the sensors that can be simulated: those of tactbench, the cheapest first, then the plugin's."""
    able = [one for one in subject.registry.sensors.all_owned() if one.ours or one.distribution == subject.distribution
            if one.descriptor.spec.skin is not None and one.descriptor.transducer is not None]  # fmt: skip
    able.sort(key=lambda one: (not one.ours, math.prod(one.descriptor.spec.skin.sheet.cells)))  # type: ignore[union-attr]
    return [one.descriptor for one in able]


def first_press(subject: Subject, scene: Scene, field: str) -> Recorded:  # noqa: RET503  (`skip` returns nothing)
    """Return the recording of a scene on the first simulated sensor that is applicable; skip if none is."""
    rig, descriptor = simulated_rig(subject)
    for sensor in simulated_sensors(subject):
        with suppress(CheckSkipped), code_of(field, subject):
            return carried_out(rig, sensor, descriptor, scene)
    skip("no simulated sensor is applicable: another rig, or recordings, are needed")


@cache
def pressed(subject: Subject, seed: int = 1) -> Recorded:
    """Return a recorded press of a sensor over its range on a simulated rig, or of any sensor by a given rig."""
    end_n = FORCE_N
    if subject.kind == "sensor":
        (rig, descriptor), sensor = simulated_rig(subject), subject.descriptor
        stated = subject.spec.data_sheet.force_range
        upper_n = 0.0 if stated is None else stated.upper * units.conversion(stated.unit, "N")
        end_n = upper_n if 0.0 < upper_n <= MOST_N else TASK_N
    elif subject.descriptor.simulated:
        descriptor, sensor = subject.descriptor, simulated_sensors(subject)[0]
        with code_of("where", subject):
            rig = subject.code("where")(rig_context(subject.registry))
    else:
        skip("the rig moves real devices, or replays recordings")
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
    scene = tiny_scene(end_n=end_n, observe=("taxel",) if "taxel" in kinds else kinds)
    with code_of("spec" if subject.kind == "sensor" else "where", subject):
        return carried_out(rig, sensor, descriptor, scene, seed)


@check("sensor", "rig", needs="transducer-reads rest-is-as-stated code-names-resolve")
def press_is_recorded(subject: Subject) -> None:
    """A recording must have one column for each channel, numbers within limits, and times that align the streams' rows.

    Yield blocks of shape (n, channels) for streams that the acquisition names; count t_ns on in whole nanoseconds, and
    state the rate in samples a second. Clip to lower and upper, mark those samples as SATURATED, others that mean
    nothing as MISSING, and check the units of the sensitivity: a SkinState has N, mm and MPa. State sign = 1 where a
    reading rises under load, -1 where it falls, 0 where it does either.
    """
    made = pressed(subject)
    for name, stream in made.came.items():
        times_are_right(f"streams: {name}", stream, SECONDS, LATE)
    fits(made.meta, made.came, made.meta.sensor)
    if subject.kind == "sensor":
        _follows_the_force(made)


def _follows_the_force(made: Recorded) -> None:
    """Fail if no channel changes any more in the upper part of a press."""
    pressing, force_n = pressing_force(made.came, made.meta.reference)
    rises = list[bool]()
    for spec in made.meta.sensor.streams:
        stream = made.came[spec.name]
        load = np.interp(stream.t_ns, pressing.t_ns, force_n) / force_n.max()  # type: ignore[arg-type]
        parts = [stream.data[(load > one) & (load < one + 0.2)].astype(float) for one in (0.0, 0.6, 0.85)]
        if all(map(len, parts)):
            low, mid, high = (one.mean(axis=0) for one in parts)
            responds = np.abs(high - low) > parts[-1].std(axis=0)
            rises.append(bool((responds & (np.abs(high - mid) > LEAST_RISE * np.abs(high - low))).any()))
    if rises and not any(rises):
        text = (
            f"no channel changes any more between {0.7 * force_n.max():.3g} and {force_n.max():.3g} N: state its range"
        )
        fail("spec.data_sheet.force_range", text)


@check("rig", needs="press-is-recorded")
def force_and_seed_decide(subject: Subject) -> None:
    """Estimators learn the recorded force, and replicates are drawn by seed: the same seed must give the same samples.

    Give a reference stream with a channel of kind "force", unit "N", called fz or normal, positive where it presses.
    Draw from a generator that `open` makes from its `seed`, never from a global generator.
    """
    made = pressed(subject)
    stream, force_n = pressing_force(made.came, made.meta.reference)
    force_is(f"reference: {stream.spec.name}", float(force_n[-5:].mean()), FORCE_N)
    same_again("streams", made, pressed.__wrapped__(subject))
    if not differing(made.arrays, pressed(subject, 2).arrays):
        fail("open(…, seed)", "two seeds give the same samples in every stream")


def same_again(where: str, one: Recorded, other: Recorded) -> None:
    """Fail if two presses with the same seed gave different samples."""
    for name in differing(one.arrays, other.arrays):
        fail(f"{where}: {name}", "a repetition with the same seed gives other samples: is any state kept or drawn?")


def _full_scene(sensors: Sequence[SensorDescriptor]) -> Scene:
    """Return a scene in which a warm indenter presses under force control and slides, so that most effects matter."""
    kinds = dict.fromkeys(one.kind for sensor in sensors for one in sensor.spec.channels())
    scene = tiny_scene(EFFECT_N, observe=tuple(kinds), unit="2", drive=ForceLoop())
    warm = scene.environment.model_copy(update={"indenter_temperature": assumed(40.0, "degC", WHY)})
    slide = Slide(speed=assumed(10.0, "mm/s", WHY), start=assumed(SECONDS / 2, "s", WHY))
    return scene.model_copy(update={"environment": warm, "slide": slide})


@check("effect", needs="code-names-resolve")
def effect_takes_part(subject: Subject) -> None:
    """A plan includes effects by the tokens that they produce and consume, and by the result of `called_for`.

    Produce what an effect or channel needs, and consume what an effect produces; compute the Reason only from the
    scene and the sensor.
    """
    effects, produced = subject.registry.effects, subject.descriptor.produces
    wanted = {*get_args(ChannelKind), *ALWAYS_WANTED, *(token for one in effects for token in one.consumes)}
    if not wanted.intersection(produced):
        fail(f"produces{list(produced)}", f"no effect or channel needs it; needed tokens: {', '.join(sorted(wanted))}")
    for unknown in set(subject.descriptor.consumes) - {token for one in effects for token in one.produces}:
        fail(f"consumes[{unknown}]", "no installed effect produces it")
    sensors = simulated_sensors(subject)
    scene, called_for = _full_scene(sensors), subject.code("called_for")
    with code_of("called_for", subject):
        answers = {repr([called_for(scene, one.spec) for one in sensors]) for _ in range(CALLS)}
    if len(answers) > 1:
        fail("called_for", "a second call with the same scene and sensor returns another reason")


def _changeable(run: Any) -> dict[str, list[Any]]:
    """Return the arrays of a simulated recording that an effect could change, by their meaning."""
    tracks = run.tracks
    return {"true force": [run.load.force_n, *(one.force_n for one in tracks)], "reference": [run.reference_n],
            "clock": [run.t_s, *(one.t_s for one in tracks)],
            "readings": [array for one in tracks for array in
                         (np.where(one.quality & Quality.MISSING, 0.0, one.readings), one.quality)]}  # fmt: skip


@check("effect", needs="effect-takes-part")
def it_is_applied(subject: Subject) -> None:
    """An effect changes a recording in progress: one NaN spoils every cell, one global draw every repetition.

    Let `where` name a function of one argument, the synthesis, that changes what it `produces` in place; guard
    divisions; draw from run.of_recording(…), run.of_session(…) or run.of_unit(…).
    """
    sensors, (rig, descriptor) = simulated_sensors(subject), simulated_rig(subject)
    scene, every = _full_scene(sensors), subject.registry.effects.all_owned()
    words = [one.descriptor.name for one in every if one.distribution == subject.distribution]  # candidates

    def press(sensor: SensorDescriptor, sign: str, seed: int = 1) -> tuple[Recorded, dict[str, list[Any]]]:
        """Return a press with the effect (sign "+") or without it ("-"), and the arrays that an effect could change."""
        simulation, held = Simulation(effects=(*words, f"{sign}{subject.name}")), list[Any]()
        own = scene.model_copy(update={"simulation": simulation})
        with code_of("where", subject):
            made = carried_out(rig, sensor, descriptor, own, seed, opened=held.append)
        return made, _changeable(held[0].run)

    changed: list[str] | None = None
    for sensor in sensors:
        with suppress(CheckSkipped):
            _, found = press(sensor, "+")
            if any(np.isnan(one).any() for one in found["readings"]):  # a converter makes numbers of them
                fail("where", "after the effect, a reading is NaN and not marked as MISSING")
            changed = ["readings"]  # where the rig cannot do without it, or it does something else
            if READINGS.issuperset(subject.descriptor.produces):
                with suppress(CheckFailed, CheckSkipped):
                    changed = differing(found, press(sensor, "-")[1])
            for name in set(changed) - {"readings"}:
                fail("where", f"the effect changes the {name}, which is not in its `produces`")
        if changed:
            break
    if changed is None:
        skip("no simulated sensor is applicable")
    if not changed:
        fail("where", "the effect changes no reading: does it act on a copy, or is its amount 0?")
    second, _ = press(sensor, "+", 2)
    for module in [one for one in sys.modules if one.partition(".")[0] == subject.package != "tactbench"]:
        del sys.modules[module]
    same_again("where", second, press(sensor, "+", 2)[0])


@check("indenter", needs="code-names-resolve")
def indenter_is_pressed(subject: Subject) -> None:
    """Heights are computed for all places at once and measured from the lowest point, which makes first contact.

    Return one finite height [mm] for each pair of x_mm and y_mm, 0 at (0, 0) and nowhere below, 50 mm or more where no
    body is present; choose defaults with flanks of up to 45 degrees. Never change x_mm or y_mm.
    """
    numbers = subject.descriptor.dimensions
    sizes = {name: one.default for name, one in numbers.items()}
    lengths = [one.default * units.conversion(one.unit, "mm") for one in numbers.values()
               if units.parse(one.unit)[1] == units.parse("mm")[1]]  # fmt: skip
    largest_mm = max(lengths, default=0.0)
    line = np.linspace(-1.0, 1.0, 61) * max(REACH_MM, 2.5 * largest_mm)
    line.flags.writeable = False

    def heights(**changed: float) -> FloatArray:
        with code_of("where", subject):
            found = np.asarray(subject.code("where")(line[:, None], line[None, :], **{**sizes, **changed}))
        if found.shape != (61, 61) or not np.isfinite(found).all():
            text = f"for places of shapes (61, 1) and (1, 61), the result has shape {found.shape}, or no finite heights"
            fail("where", f"{text}, with {changed or sizes}")
        return found

    found = heights()
    if abs(found[30, 30]) > LOWEST_MM or found.min() < -LOWEST_MM:
        fail("where", f"the height is {found[30, 30]:g} mm at (0, 0), and {found.min():g} mm at least: 0 is needed")
    if not np.array_equal(found, heights()):
        fail("where", "a second call gives other heights for the same places")
    for name, one in numbers.items():
        same = list[bool]()
        for share in (0.7, 1.4):
            value = min(max(one.least, share * one.default or share), math.inf if one.most is None else one.most)
            with suppress(UsageError):  # dimensions that do not go with each other
                same += [] if value == one.default else [np.array_equal(heights(**{name: value}), found)]
        if same and all(same):
            fail(f"dimensions[{name}]", "the heights do not depend on this dimension")
    body, highest_mm = found > LOWEST_MM, found[np.hypot(line[:, None], line) <= 1.5 * largest_mm].max()
    if highest_mm < FLAT * largest_mm:
        text = f"{highest_mm:.2g} mm high within 1.5 of its largest dimension, {largest_mm:g} mm"
        fail("where", f"{text}: are x_mm and y_mm read in millimetres?")
    if body.any() and not body[0].any() and not body[:, 0].any():
        fail("where", f"the height is 0 mm at {line[-1]:.3g} mm: 50 mm or more is needed beside the body")
    default = {name: assumed(one.default, one.unit, WHY) for name, one in numbers.items()}
    first_press(subject, tiny_scene(indenter=Indenter(shape=subject.name, dimensions=default)), "where")


@check("profile", needs="code-names-resolve")
def path_is_recorded(subject: Subject) -> None:
    """A recording needs an unloaded hold for taring, and enough samples to reach the force of the path.

    Begin with a hold at 0 N, state newtons (a gram-force is 0.0098 N), and give enough samples for each piece.
    """
    with code_of("where", subject):
        path = force_path(subject.descriptor, {}, WHY)
    if path.forces_n[0] != 0 or not path.hold_s > 0:
        fail("where", f"the path starts at {path.forces_n[0]:g} N and holds {path.hold_s:g} s: no time for taring")
    if path.largest_n > MOST_N:
        fail("where", f"the largest force is {path.largest_n:g} N by default: are these gram-force?")
    made = first_press(subject, tiny_scene(profile=path), "where")
    recorded = float(pressing_force(made.came, made.meta.reference)[1].max())
    if abs(recorded - path.largest_n) > FORCE_SHARE * path.largest_n:
        fail("where", f"the {path.samples} samples reach {recorded:.3g} N, but the path {path.largest_n:g} N")
