"""Checks of what a small press on a simulated rig gives, recorded and read back; and of rigs' forces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from tactbench.core.conformance.check import CheckSkipped, Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import (
    Recorded,
    carried_out,
    force_is,
    marks_of,
    pressing_force,
    times_are_right,
    within_limits,
)
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.samples import Quality
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Environment, Scene

FORCE_N = 0.5
"""At the end of the press: every sensor that is touched by a hand bears it."""
SECONDS, LATE = 1.0, 0.5
"""How long it lasts; and by which share more or less for a rig that begins later."""
NOISE_N = 0.005
"""Of the reference force: a hundredth of the press, so that draws can be told apart and the force still be read."""
MOST_SATURATED = 0.5
"""Share of the samples of a press over the task's range that a taxel may stand at a limit."""
WHY = "a check of plugins"


def slow_ramp(end_n: float, seconds: float, hold_s: float) -> ForceRamp:
    """Return a press of a hundred samples."""
    end, hold, duration = assumed(end_n, "N", WHY), assumed(hold_s, "s", WHY), assumed(seconds, "s", WHY)
    return ForceRamp(end=end, hold=hold, duration=duration, samples=100)


def tiny_scene(name: str = "tiny", end_n: float = FORCE_N, **changes: Any) -> Scene:
    """Return a press of a second to half a newton, with everything else as scenes have it."""
    environment = Environment(force_noise=assumed(NOISE_N, "N", WHY))
    scene = Scene(name=name, profile=slow_ramp(end_n, SECONDS, SECONDS / 5), environment=environment)
    return scene.model_copy(update=changes)


def simulated_rig(subject: Subject) -> tuple[Any, RigDescriptor]:
    """Return the first simulated rig, built, those that come with this package before others."""
    simulated = (one for one in subject.registry.rigs.all_owned() if one.descriptor.simulated)
    descriptor = min(simulated, key=lambda one: not one.ours).descriptor
    return load_object(descriptor.where)(rig_context(subject.registry)), descriptor


def simulated_sensors(subject: Subject) -> Sequence[SensorDescriptor]:
    """Return sensors that a simulation can press: of this package, the cheapest first, then of the plugin's own."""
    able = []
    for owned in subject.registry.sensors.all_owned():
        skin = owned.descriptor.spec.skin
        near = owned.ours or owned.distribution == subject.distribution
        if near and skin is not None and owned.descriptor.transducer is not None:
            cost = len(owned.descriptor.spec.channels()) * math.prod(skin.sheet.cells)
            able.append((not owned.ours, cost, owned.descriptor.name, owned.descriptor))
    return [one[-1] for one in sorted(able, key=lambda one: one[:3])]


def presses(subject: Subject, scenes: Sequence[Scene], field: str) -> Iterator[Recorded]:
    """Yield what every simulated sensor and scene that go with each other give."""
    rig, descriptor = simulated_rig(subject)
    for scene in scenes:
        for sensor in simulated_sensors(subject):
            try:
                with code_of(field, subject):
                    yield carried_out(rig, sensor, descriptor, scene)
            except CheckSkipped:
                continue


@lru_cache(maxsize=6)
def pressed(subject: Subject, seed: int = 1) -> Recorded:
    """Return a press: of a sensor on a simulated rig over the range of the task `force`, or of a rig, a tiny one."""
    if subject.kind == "sensor":
        (rig, descriptor), sensor, field = simulated_rig(subject), subject.descriptor, "spec"
        end_n = max(one.scene.profile.largest_n for one in subject.registry.tasks["force"].spec.scenes)
    elif subject.descriptor.simulated:
        descriptor, sensor, field, end_n = subject.descriptor, simulated_sensors(subject)[0], "where", FORCE_N
        with code_of(field, subject):
            rig = subject.code(field)(rig_context(subject.registry))
    else:
        skip("it moves something real, or replays: `--rig-file FILE` presses with it")
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
    with code_of(field, subject):
        scene = tiny_scene(end_n=end_n, observe=("taxel",) if "taxel" in kinds else kinds)
        return carried_out(rig, sensor, descriptor, scene, seed)


@check("sensor", "rig", needs="transducer-reads rest-is-as-stated code-names-resolve")
def press_is_recorded(subject: Subject) -> None:
    """A recording has a column a channel, numbers only, and times by which rows are put on one clock.

    Yield blocks of shape (n, channels) for streams that the acquisition names; mark what means nothing as MISSING;
    count t_ns on in whole nanoseconds, and state the rate in samples a second.
    """
    made = pressed(subject)
    for name, stream in made.came.items():
        times_are_right(f"streams: {name}", stream, SECONDS, LATE)


@check("sensor", "rig", needs="press-is-recorded")
def limits_are_kept(subject: Subject) -> None:
    """A converter gives nothing beyond its ends; what stands at an end is marked as saturated, and tells nothing.

    Clip to lower and upper, mark those samples as Quality.SATURATED, and look at the units of the sensitivity: a
    SkinState has N, mm and MPa.
    """
    made = pressed(subject)
    for spec in made.meta.sensor.streams:
        stream = made.came[spec.name]
        for column, channel in enumerate(spec.channels):
            where, values = f"streams: {spec.name}.{channel.name}", stream.data[:, column]
            limits = within_limits(where, channel, values)
            # One that rests at an end has that reading without being full.
            rest = None if channel.rest is None else channel.rest.to(channel.unit)
            at_end = np.isin(values, [end for end in limits if end != rest])
            full = (marks_of(stream)[:, column] & Quality.SATURATED) != 0
            if channel.unit == "count" and (at_end & ~full).any():
                fail(where, "it stands at its end, not marked SATURATED")
            if subject.kind == "sensor" and channel.kind == "taxel" and full.mean() > MOST_SATURATED:
                fail(
                    where,
                    f"{full.mean():.0%} of its samples stand at a limit in a press over the range of the task force",
                )


@check("rig", needs="press-is-recorded")
def force_and_seed_decide(subject: Subject) -> None:
    """The recorded force is what estimators are taught, and replicates are drawn anew: the same seed gives the same.

    Give a reference stream with a channel of kind "force", unit "N", called fz or normal, positive where it presses.
    Draw from a generator that `open` makes of its `seed`, never from a global one.
    """
    made = pressed(subject)
    stream, force_n = pressing_force(made.came, made.meta.reference)
    force_is(f"reference: {stream.spec.name}", float(force_n[-5:].mean()), FORCE_N)
    changed = differing(made, pressed.__wrapped__(subject))
    if changed:
        fail(f"streams: {changed[0]}", "another press with the same seed gives other samples")
    if not differing(made, pressed(subject, 2)):
        fail("open(…, seed)", "two seeds give the same samples in every stream")


def differing(one: Recorded, other: Recorded) -> list[str]:
    """Return the streams of which two presses give other samples."""
    return [name for name, stream in one.came.items() if stream.data.tobytes() != other.came[name].data.tobytes()]
