"""Checks of an effect of the simulated rig."""

from __future__ import annotations

import copy
import math
import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, get_args

from tactbench.core.conformance.check import check, code_of, fail, skip
from tactbench.core.conformance.common import difference
from tactbench.core.conformance.subject import Subject
from tactbench.core.conformance.trial_press import (
    TrialPress,
    carried_out,
    first_that_goes,
    scenes_of,
    simulated_sensors,
)
from tactbench.core.errors import UsageError, nearest
from tactbench.core.plugins.interfaces import Reason
from tactbench.core.spec import units
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelKind

_WORD = re.compile(r"[a-z][a-z0-9-]*")
ALWAYS_WANTED = ("stored", "reference-force")
"""What every recording needs, beside the kinds of channels that are observed."""


def _scenes(subject: Subject) -> Sequence[Scene]:
    kinds = tuple(dict.fromkeys(one.kind for sensor in simulated_sensors(subject) for one in sensor.spec.channels()))
    return tuple(scenes_of(kinds or ("taxel",)))


@check("effect")
def name_can_be_asked_for(subject: Subject) -> None:
    """Whoever wants an effect, or wants to be without it, writes ``+name`` or ``-name``.

    Use lower-case letters, digits and hyphens in the name and the groups, and not ``all``.
    """
    descriptor = subject.descriptor
    for field, name in (("name", descriptor.name), *(("groups", group) for group in descriptor.groups)):
        if not _WORD.fullmatch(name) or name == "all":
            fail(field, f"{name!r} cannot be written behind + or -")


@check("effect")
def tokens_are_known(subject: Subject) -> None:
    """A plan includes whoever produces what is needed: a misspelt token is needed by nobody, or produced by nobody.

    Produce a kind of channel, or a token that an effect consumes; consume what an effect produces.
    """
    descriptor = subject.descriptor
    effects = [*(one for one in subject.registry.effects if one.name != descriptor.name), descriptor]
    produced = {token for one in effects for token in one.produces}
    consumed = {token for one in effects for token in one.consumes}
    consumable = {*consumed, *get_args(ChannelKind), *ALWAYS_WANTED}
    for token in descriptor.consumes:
        if token not in produced:
            fail(f"consumes[{token}]", f"no installed effect produces it{_meant(token, produced)}")
    if not descriptor.produces:
        fail("produces", "it is empty: nothing that is observed could ever need the effect")
    if not consumable.intersection(descriptor.produces):
        token = descriptor.produces[0]
        fail(
            f"produces[{token}]",
            f"no installed effect consumes it, and it is no kind of channel{_meant(token, consumable)}",
        )


def _meant(token: str, known: set[str]) -> str:
    close = nearest(token, known)
    return f"; did you mean {' or '.join(close)}?" if close else ""


@check("effect", needs=("code-names-resolve",))
def it_says_when_it_is_called_for(subject: Subject) -> None:
    """The plan of a scene is shown to its reader with the reason of every effect, included or left out.

    Let called_for(scene, sensor) return a tactbench.plugin.simulation.Reason with a text, for every scene and sensor.
    """
    decide = subject.code("called_for")
    for scene in _scenes(subject):
        for sensor in simulated_sensors(subject):
            before = (scene.model_dump(mode="json"), sensor.spec.model_dump(mode="json"))
            with code_of("called_for", subject.package):
                reason = decide(scene, sensor.spec)
            if not isinstance(reason, Reason):
                fail("called_for", f"it returned a {type(reason).__name__}, and a Reason is needed")
            _looks_right(reason)
            place = difference(before[0], scene.model_dump(mode="json"), "scene")
            place = place or difference(before[1], sensor.spec.model_dump(mode="json"), "sensor")
            if place:
                fail(f"called_for: {place}", "it has changed it")


def _looks_right(reason: Reason) -> None:
    if not isinstance(reason.called_for, bool):
        fail("called_for: Reason.called_for", f"{reason.called_for!r} is neither True nor False")
    if not isinstance(reason.text, str) or not reason.text.strip():
        fail("called_for: Reason.text", "it is empty: why, or why not?")
    if reason.change is not None and not (math.isfinite(reason.change) and reason.change >= 0):
        fail("called_for: Reason.change", f"{reason.change}: a bound of 0 or more is needed, or None")
    try:
        units.parse(reason.unit)
    except UsageError as error:
        fail("called_for: Reason.unit", str(error))


@check("effect", needs=("it-says-when-it-is-called-for",))
def the_same_scene_the_same_reason(subject: Subject) -> None:
    """A plan is part of a recording's key: it must come out the same tomorrow.

    Decide from the scene and the spec alone.
    """
    decide = subject.code("called_for")
    for scene in _scenes(subject):
        for sensor in simulated_sensors(subject):
            first, second = decide(scene, sensor.spec), decide(scene, sensor.spec)
            if first != second:
                fail("called_for", f"asked twice it said {first.text!r} and {second.text!r}")


@lru_cache(maxsize=2)
def _pressed(subject: Subject) -> tuple[TrialPress, Any, Any, Any, Scene]:
    """Return a tiny press with the effect asked for by name, and with what it was made."""
    descriptor = subject.descriptor
    decide = subject.code("called_for")
    sensors = simulated_sensors(subject)
    scenes = _scenes(subject)
    calling = [scene for scene in scenes if any(decide(scene, one.spec).called_for for one in sensors)]
    found = first_that_goes(subject, calling or scenes, descriptor.name, "where")
    if found is None:
        skip("no simulated sensor and scene go with it")
    rig, of_rig, sensor, scene, made = found
    return made, rig, of_rig, sensor, scene


@check("effect", needs=("it-says-when-it-is-called-for", "tokens-are-known", "name-can-be-asked-for"), level="silver")
def it_is_applied(subject: Subject) -> None:
    """An effect is a function of the recording in the making; whether it can be stepped shows when it is.

    Let `where` name a function of one argument, the synthesis, that changes it in place.
    """
    made = _pressed(subject)[0]
    (entry,) = [one for one in made.plan if one.effect == subject.name]
    # The solve may leave out what it was lent and did not need.
    if not (entry.included or entry.asked):
        fail("produces", "it was asked for by name, and the plan left it out")


@check("effect", needs=("it-is-applied",), level="silver")
def it_leaves_numbers(subject: Subject) -> None:
    """One NaN in one sample ends every cell that reads it.

    Guard divisions and square roots; at rest forces and areas are 0.
    """
    import numpy as np

    made = _pressed(subject)[0]
    for stream in made.every_stream:
        bad = np.argwhere(~np.isfinite(made.values(stream.name)))
        if len(bad):
            row, column = bad[0]
            fail(f"where: {stream.name}.{stream.channels[column].name}", f"it is not finite in row {row}")


@check("effect", needs=("it-is-applied",), level="silver")
def it_repeats_under_a_seed(subject: Subject) -> None:
    """A recording is made again from its seed, bit for bit; an effect that draws elsewhere breaks all of it.

    Draw from run.of_recording(…), run.of_session(…) or run.of_unit(…), never from numpy.random.
    """
    import numpy as np

    first, rig, of_rig, sensor, scene = _pressed(subject)
    with code_of("where", subject.package):
        again = carried_out(rig, of_rig, sensor, scene, 1)
    for stream in first.every_stream:
        if not np.array_equal(first.values(stream.name), again.values(stream.name), equal_nan=True):
            fail(f"where: {stream.name}", "another press with the same seed gives other samples")


@check("effect", needs=("it-is-applied",), level="silver")
def it_leaves_the_sensor_alone(subject: Subject) -> None:
    """Scene and spec are part of the recording's key and of every recording after this one.

    Change the synthesis' readings; copy what else you change.
    """
    _, rig, of_rig, sensor, scene = _pressed(subject)
    before = copy.deepcopy((scene.model_dump(mode="json"), sensor.model_dump(mode="json")))
    with code_of("where", subject.package):
        carried_out(rig, of_rig, sensor, scene, 1)
    place = difference(before[0], scene.model_dump(mode="json"), "scene")
    place = place or difference(before[1], sensor.model_dump(mode="json"), "sensor")
    if place:
        fail(f"where: {place}", "the effect has changed it")


CHECKS = (
    name_can_be_asked_for, tokens_are_known, it_says_when_it_is_called_for, the_same_scene_the_same_reason,
    it_is_applied, it_leaves_numbers, it_repeats_under_a_seed, it_leaves_the_sensor_alone,
)  # fmt: skip
