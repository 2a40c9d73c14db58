"""Checks of what a small press on a simulated rig gives, recorded and read back, and of all that takes part in it."""

from __future__ import annotations

import copy
import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from typing import Any, get_args

import numpy as np

from tactbench.core.conformance.check import CheckSkipped, Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import (
    FORCE_SHARE,
    Recorded,
    carried_out,
    force_is,
    marks_of,
    pressing_force,
    times_are_right,
    within_limits,
)
from tactbench.core.errors import UsageError, nearest
from tactbench.core.plugins.force_profiles import force_path
from tactbench.core.plugins.interfaces import Reason
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.rigs import rig_context
from tactbench.core.samples import FloatArray, Quality
from tactbench.core.spec import units
from tactbench.core.spec.drive import ForceLoop
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Environment, Indenter, Scene, Simulation, Slide
from tactbench.core.spec.sensor import ChannelKind

FORCE_N, REAL_N, EFFECT_N = 0.5, 1.0, 2.0  # every sensor bears the first; motors follow the second; effects need load
NOISE_N = 0.005  # of the reference: a hundredth of the press, so that draws can be told apart
SECONDS, LATE = 1.0, 0.5  # how long a press lasts; by which share more or less for a rig that begins later
MOST_SATURATED = 0.5  # share of the samples of a press that a taxel may stand at a limit
LEAST_RISE = 0.02  # of its whole change, in the upper part of a channel's range (assumed: foams harden)
ALWAYS_WANTED = ("stored", "reference-force")  # what every recording needs, beside the kinds of channels
REACH_MM, FLAT = 15.0, 2e-3  # heights are looked at so far; share of its largest dimension by which a body rises there
LOWEST_MM = 1e-9  # by which the lowest point may miss 0: rounding
ASKED = 8  # calls of `called_for` for one scene: what is drawn then shows
MOST_N = 100.0  # beyond the rated range of every tactile sensor of a finger
WHY = "a check of plugins"


def slow_ramp(end_n: float, seconds: float, hold_s: float) -> ForceRamp:
    """Return a press of a hundred samples."""
    end, hold, duration = assumed(end_n, "N", WHY), assumed(hold_s, "s", WHY), assumed(seconds, "s", WHY)
    return ForceRamp(end=end, hold=hold, duration=duration, samples=100)


def tiny_scene(end_n: float = FORCE_N, **changes: Any) -> Scene:
    """Return a press of a second to half a newton, with everything else as scenes have it."""
    environment = Environment(force_noise=assumed(NOISE_N, "N", WHY))
    scene = Scene(name="check", profile=slow_ramp(end_n, SECONDS, SECONDS / 5), environment=environment)
    return scene.model_copy(update=changes)


def simulated_rig(subject: Subject) -> tuple[Any, RigDescriptor]:
    """Return the first simulated rig, built, those that come with this package before others.

    An effect that is checked is watched while it is applied.
    """
    descriptor = subject.registry.rigs[subject.registry.first_rig("simulated")]
    context = rig_context(subject.registry)
    if subject.kind == "effect":
        _WATCHED.update(effect=subject.descriptor, wrong=[], changed=False)
        watching = {"where": f"{__name__}:watched"}
        effects, named = (
            tuple(one.model_copy(update=watching) if one.name == subject.name else one for one in several)
            for several in (context.effects, context.named_effects)
        )
        context = replace(context, effects=effects, named_effects=named)
    return load_object(descriptor.where)(context), descriptor


_WATCHED: dict[str, Any] = {}
"""The effect that is watched, what it does wrong, and whether it changes anything."""


def watched(run: Any, *more: Any) -> Any:
    """Apply the effect that is watched, and look at what it leaves alone and what it changes."""
    effect = _WATCHED["effect"]
    apply = load_object(effect.where)
    if not hasattr(run, "tracks"):  # called upon while solving
        return apply(run, *more)

    def state() -> dict[str, Any]:
        return {"true force": [run.load.force_n, *(one.force_n for one in run.tracks)], "reference": [run.reference_n],
                "clock": [run.t_s, *(one.t_s for one in run.tracks)],
                "readings": [array for one in run.tracks for array in (one.readings, one.quality)]}  # fmt: skip

    before = copy.deepcopy(state())
    apply(run)
    changed = {name for name, arrays in state().items() for a, b in zip(before[name], arrays, strict=True)
               if not np.array_equal(a, b, equal_nan=True)}  # fmt: skip
    _WATCHED["changed"] |= "readings" in changed
    wrong = changed - {"readings", "reference" if "reference-force" in effect.produces else ""}
    _WATCHED["wrong"] += [f"it changes the {name}, which its `produces` does not name" for name in sorted(wrong)]
    if any((np.isnan(one.readings) & ((one.quality & Quality.MISSING) == 0)).any() for one in run.tracks):
        _WATCHED["wrong"].append("a reading is not a number after it, and not marked as MISSING")
    return None


def simulated_sensors(subject: Subject) -> Sequence[SensorDescriptor]:
    """Return sensors that a simulation can press: of this package, the cheapest first, then of the plugin's own."""
    able = [(not one.ours, math.prod(one.descriptor.spec.skin.sheet.cells), one.descriptor.name, one.descriptor)
            for one in subject.registry.sensors.all_owned() if one.ours or one.distribution == subject.distribution
            if one.descriptor.spec.skin is not None and one.descriptor.transducer is not None]  # fmt: skip
    return [one[-1] for one in sorted(able, key=lambda one: one[:3])]


def presses(subject: Subject, scenes: Sequence[Scene], field: str, seed: int = 1) -> Iterator[Recorded]:
    """Yield what every simulated sensor and scene that go with each other give."""
    rig, descriptor = simulated_rig(subject)
    for scene in scenes:
        for sensor in simulated_sensors(subject):
            with suppress(CheckSkipped), code_of(field, subject):
                yield carried_out(rig, sensor, descriptor, scene, seed)


def _own_range_n(subject: Subject) -> float:
    """Return up to which force [N] a sensor answers by its data sheet; 0: it does not say, or beyond any finger's."""
    stated = getattr(subject.spec, "data_sheet", None) and subject.spec.data_sheet.force_range
    upper_n = 0.0 if stated is None else stated.upper * units.conversion(stated.unit, "N")
    return upper_n if upper_n <= MOST_N else 0.0


@lru_cache(maxsize=6)
def pressed(subject: Subject, seed: int = 1) -> Recorded:
    """Return a press: of a sensor on a simulated rig over the range of tasks of force, or of a rig, a tiny one."""
    if subject.kind == "sensor":
        (rig, descriptor), sensor, field = simulated_rig(subject), subject.descriptor, "spec"
        tasks = [one.descriptor.spec for one in subject.registry.tasks.all_owned() if one.ours]
        forces = [one.scene.profile.largest_n for task in tasks if getattr(task.target, "kind", "") == "force"
                  for one in task.scenes]  # fmt: skip
        end_n = _own_range_n(subject) or max(forces, default=FORCE_N)
    elif subject.descriptor.simulated:
        descriptor, sensor, field, end_n = subject.descriptor, simulated_sensors(subject)[0], "where", FORCE_N
    else:
        skip("it moves something real, or replays: with `--rig-file FILE` other checks press with it")
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
    with code_of(field, subject):
        if subject.kind == "rig":
            rig = subject.code(field)(rig_context(subject.registry))
        scene = tiny_scene(end_n=end_n, observe=("taxel",) if "taxel" in kinds else kinds)
        return carried_out(rig, sensor, descriptor, scene, seed)


@check("sensor", "rig", needs="transducer-reads rest-is-as-stated code-names-resolve")
def press_is_recorded(subject: Subject) -> None:
    """A recording has a column a channel, numbers within their limits, and times by which rows are put on one clock.

    Yield blocks of shape (n, channels) for streams that the acquisition names; count t_ns on in whole nanoseconds, and
    state the rate in samples a second. Clip to lower and upper, mark those samples as SATURATED, others that mean
    nothing as MISSING, and look at the units of the sensitivity: a SkinState has N, mm and MPa.
    """
    made = pressed(subject)
    for name, stream in made.came.items():
        times_are_right(f"streams: {name}", stream, SECONDS, LATE)
    upper_n, rises = _own_range_n(subject) if subject.kind == "sensor" else 0.0, list[bool]()
    for spec in made.meta.sensor.streams:
        stream = made.came[spec.name]
        for column, channel in enumerate(spec.channels):
            where = f"streams: {spec.name}.{channel.name}"
            within_limits(where, channel, stream.data[:, column])
            full = (marks_of(stream)[:, column] & Quality.SATURATED) != 0
            if subject.kind == "sensor" and channel.kind == "taxel" and full.mean() > MOST_SATURATED:
                fail(where, f"{full.mean():.0%} of its samples stand at a limit in a press over its range of forces")
        if upper_n:
            pressing, force_n = pressing_force(made.came, made.meta.reference)
            load = np.interp(stream.t_ns, pressing.t_ns, force_n) / upper_n  # type: ignore[arg-type]
            parts = [stream.data[(load > one) & (load < one + 0.2)].astype(float) for one in (0.0, 0.6, 0.85)]
            if all(map(len, parts)):
                low, mid, high = (one.mean(axis=0) for one in parts)
                felt, late = np.abs(high - low) > parts[-1].std(axis=0), np.abs(high - mid)
                rises.append(bool((felt & (late > LEAST_RISE * np.abs(high - low))).any()))
    if rises and not any(rises):
        text = f"no channel changes any more between {0.7 * upper_n:.3g} and {upper_n:.3g} N, its own range"
        fail("spec.data_sheet.force_range", text)


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


def _effected(subject: Subject, seed: int = 1) -> Recorded:
    """Return a press with the effect, on the first sensor of which it changes a reading, or else on the first."""
    siblings = (one for one in subject.registry.effects.all_owned() if one.distribution == subject.distribution)
    words = [one.descriptor.name for one in siblings if set(subject.descriptor.consumes) & set(one.descriptor.produces)]
    sensors = simulated_sensors(subject)
    plain = tiny_scene(
        end_n=EFFECT_N, observe=tuple(dict.fromkeys(one.kind for sensor in sensors for one in sensor.spec.channels())),
        simulation=Simulation(effects=(*words, f"+{subject.name}")), unit="2",
    )  # fmt: skip
    warm = plain.environment.model_copy(update={"indenter_temperature": assumed(40.0, "degC", WHY)})
    slide = Slide(speed=assumed(10.0, "mm/s", WHY), start=assumed(SECONDS / 2, "s", WHY))
    full = plain.model_copy(update={"drive": ForceLoop(), "environment": warm, "slide": slide})
    for sensor in sensors:
        with code_of("called_for", subject):
            reasons = [subject.code("called_for")(full, sensor.spec) for _ in range(ASKED)]
        if not isinstance(reasons[0], Reason) or not reasons[0].text:
            fail("called_for", f"it returned {reasons[0]!r}, and a Reason(called_for, text, change) is needed")
        if len(set(reasons)) > 1:
            fail("called_for", "it returns another reason for the same scene and sensor")
    found = None
    for made in presses(subject, (full, plain), "where", seed):
        found = found or made
        if _WATCHED["changed"]:
            return made
    return skip("no simulated sensor and scene go with it") if found is None else found


@check("effect", needs="code-names-resolve")
def it_is_applied(subject: Subject) -> None:
    """An effect changes a recording in the making: one NaN ends every cell, one draw elsewhere is never repeated.

    Return a Reason with a text from called_for(scene, sensor); produce what an effect or channel needs; let `where`
    name a function of one argument, the synthesis, that changes it in place; guard divisions; draw from
    run.of_recording(…), run.of_session(…) or run.of_unit(…).
    """
    produced = subject.descriptor.produces
    consumed = {token for one in subject.registry.effects for token in one.consumes}
    wanted = {*get_args(ChannelKind), *ALWAYS_WANTED, *consumed}
    if not wanted.intersection(produced):
        close = nearest(produced[0], wanted) if produced else []
        fail(f"produces{list(produced)}", f"nothing needs it{f'; did you mean {close[0]}?' if close else ''}")
    unknown = sorted(set(subject.descriptor.consumes) - {t for one in subject.registry.effects for t in one.produces})
    if unknown:
        fail(f"consumes[{unknown[0]}]", "no installed effect produces it")
    made = _effected(subject)
    plain = {*get_args(ChannelKind), "disturbance", "reading", "stored"}.issuperset(produced)
    if plain and _WATCHED["wrong"]:
        fail("where", _WATCHED["wrong"][0])
    if plain and not _WATCHED["changed"]:
        fail("where", "no reading is another one after it: does it change a copy, or an amount that is 0?")
    changed = differing(made, _effected(subject))
    if changed:
        fail(f"where: {changed[0]}", "another press with the same seed gives other samples")
    second = _effected(subject, seed=2)
    for module in [one for one in sys.modules if one.partition(".")[0] == subject.package != "tactbench"]:
        del sys.modules[module]
    changed = differing(second, _effected(subject, seed=2))
    if changed:
        fail(f"where: {changed[0]}", "imported anew it gives other samples: it keeps something of recordings before")


@check("indenter", needs="code-names-resolve")
def indenter_is_pressed(subject: Subject) -> None:
    """A height is asked for at all places at once and counted from the lowest point, which touches first.

    Return one finite height [mm] for each pair of x_mm and y_mm, 0 at (0, 0) and nowhere below, 50 mm or more where no
    body is; choose defaults with flanks of up to 45 degrees.
    """
    numbers = subject.descriptor.dimensions
    sizes = {name: one.default for name, one in numbers.items()}
    lengths = [one.default * units.conversion(one.unit, "mm") for one in numbers.values()
               if units.parse(one.unit)[1] == units.parse("mm")[1]]  # fmt: skip
    reach_mm = max(REACH_MM, *(2.5 * one for one in lengths), 0.0)
    line = np.linspace(-reach_mm, reach_mm, 61)

    def heights(**changed: float) -> FloatArray:
        x_mm, y_mm = line[:, None].copy(), line[None, :].copy()
        with code_of("where", subject):
            found = np.asarray(subject.code("where")(x_mm, y_mm, **{**sizes, **changed}))
        if not (np.array_equal(x_mm[:, 0], line) and np.array_equal(y_mm[0], line)):
            fail("where", "it changes x_mm or y_mm in place")
        if found.shape != (61, 61) or not np.isfinite(found).all():
            text = f"for places of shapes (61, 1) and (1, 61) it returned shape {found.shape}, or no finite heights"
            fail("where", f"{text}, with {changed or sizes}")
        return found

    found = heights()
    if abs(found[30, 30]) > LOWEST_MM or found.min() < -LOWEST_MM:
        fail("where", f"it is {found[30, 30]:g} mm high at (0, 0), at least {found.min():g} mm: 0 is needed")
    if not np.array_equal(found, heights()):
        fail("where", "it gives other heights for the same places when it is called again")
    for name, one in numbers.items():
        most, changes = math.inf if one.most is None else one.most, []
        others = {min(max(one.least, share * one.default or share), most) for share in (0.7, 1.4)}
        for value in others - {one.default}:
            with suppress(UsageError):  # dimensions that do not go with each other
                changes.append(not np.array_equal(heights(**{name: value}), found))
        if changes and not any(changes):
            fail(f"dimensions[{name}]", "the heights are the same whatever it is")
    away = np.hypot(line[:, None], line[None, :])
    largest_mm, body = max(lengths, default=0.0), found > LOWEST_MM
    highest_mm = found[away <= 1.5 * largest_mm].max()
    if highest_mm < FLAT * largest_mm:
        text = f"{highest_mm:.2g} mm high within 1.5 of its largest dimension, {largest_mm:g} mm"
        fail("where", f"{text}: are x_mm and y_mm read in millimetres?")
    if body.any() and body[(away > 0) & (away <= away[body].max())].all() and not body[0].any():
        fail("where", f"it is 0 mm high beyond {away[body].max():.3g} mm: 50 mm or more is needed where no body is")
    default = {name: assumed(one.default, one.unit, WHY) for name, one in numbers.items()}
    next(presses(subject, (tiny_scene(indenter=Indenter(shape=subject.name, dimensions=default)),), "where"))


@check("profile", needs="code-names-resolve")
def path_is_recorded(subject: Subject) -> None:
    """A recording is tared on its own unloaded hold, and has as many samples of the force as the path says.

    Begin with a hold at 0 N, state newtons (a gram-force is 0.0098 N), and give samples enough for each piece.
    """
    with code_of("where", subject):
        path = force_path(subject.descriptor, {}, WHY)
    if path.forces_n[0] != 0 or not path.hold_s > 0:
        fail("where", f"it begins at {path.forces_n[0]:g} N with {path.hold_s:g} s of hold: none is left to tare on")
    if path.largest_n > MOST_N:
        fail("where", f"its largest force is {path.largest_n:g} N by default: are these gram-force?")
    made = next(presses(subject, (tiny_scene(profile=path),), "where"))
    recorded = float(pressing_force(made.came, made.meta.reference)[1].max())
    if abs(recorded - path.largest_n) > FORCE_SHARE * path.largest_n:
        fail("where", f"its {path.samples} samples reach {recorded:.3g} N, and the path {path.largest_n:g} N")
