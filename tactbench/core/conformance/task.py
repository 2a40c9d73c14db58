"""Checks of a task: every name it uses exists, and its scenes can be carried out."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args

import numpy as np
from pydantic import BaseModel

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.press import MOST_N, SECONDS, WHY, presses, tiny_scene
from tactbench.core.conformance.sensor_spec import OF_KIND
from tactbench.core.errors import nearest
from tactbench.core.spec import units
from tactbench.core.spec.quantity import Quantity, assumed
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import ChannelTarget, LabelTarget, PlannedScene, TaskSpec

REFERENCE = ("force", "torque", "position")  # channels of which references are made: features give labels away
PARTS = ("indenter", "placement", "profile", "slide", "environment")  # of a scene, that a label may be about
LEAST_SCENES = 5  # or labels, from which it is no chance that a number rises with a label
LEAST_M, LARGEST_M = 1e-5, 1.0  # radii of caps that are pressed on a sensor
LEAST_FORCE = 0.05  # of a force target's unit, that scenes reach at least
GROUPS = ("recording", "unit", "trial", "press", "object", "block")  # beside labels, of recordings or our mappings


def _planned(spec: TaskSpec) -> Iterator[tuple[str, PlannedScene]]:
    """Yield every planned scene with its place."""
    for name, campaign in (("scenes", spec.scenes), *((f"campaigns[{k}]", v) for k, v in spec.campaigns.items())):
        for planned in campaign:
            yield f"spec.{name}[{planned.scene.name}]", planned


@check("task")
def names_are_known(subject: Subject) -> None:
    """Protocols, splits and estimators are looked up when everything has been recorded.

    Name protocols of docs/protocols.md, splits that its recordings serve, and estimators and baselines of its kind.
    """
    from tactbench.core.evaluation.protocols import protocol_called, shots
    from tactbench.core.evaluation.splits import SPLITS_WITHOUT_GROUPS

    spec = subject.spec
    missing = sorted(set(get_args(Role)) - {planned.role for planned in spec.scenes}) if spec.scenes else []
    with code_of("spec.protocols", subject):
        for name in spec.protocols:
            if protocol_called(name).roles_only and missing:
                fail("spec.protocols", f"{name} chooses on recordings of the role {missing[0]}; no scene has it")
    labels = {label for _, planned in _planned(spec) for label in planned.scene.labels}
    known = {*SPLITS_WITHOUT_GROUPS, *GROUPS, *spec.campaigns, *labels}
    for name in spec.splits:
        # Without scenes, a group may be any annotation of recordings that others have made.
        if name not in known and shots(name) is None and (spec.scenes or nearest(name, known)):
            served = ", ".join(sorted(known))
            fail("spec.splits", f"{name!r} is no split that recordings of this task could serve; there are {served}")
    for field in ("estimators", "baselines"):
        with code_of(f"spec.{field}", subject):
            for found in [subject.registry.estimators[name] for name in getattr(spec, field)]:
                if spec.kind not in found.kinds:
                    fail(f"spec.{field}", f"{found.name} is for {' and '.join(found.kinds)}, not for {spec.kind}")
                if field == "baselines" and not found.baseline:
                    fail("spec.baselines", f"{found.name} is no trivial answer by its own account")


@check("task")
def metric_has_its_unit(subject: Subject) -> None:
    """The unit stands beside every score: errors are computed in the target's unit, and nobody converts them.

    Name a metric of the task's kind; state the target's unit for errors (rmse, mae, mean_euclidean_error), else 1.
    """
    from tactbench.core.evaluation.metrics import METRICS

    spec = subject.spec
    metric = METRICS[spec.metric]
    if metric.kind != spec.kind:
        fail("spec.metric", f"{spec.metric} is for {metric.kind}, and the task is a {spec.kind}")
    target_unit = getattr(spec.target, "unit", "1")  # frames that slip or do not have none
    if isinstance(spec.target, LabelTarget) and "unit" not in spec.target.model_fields_set:
        target_unit = spec.unit  # a label of which nobody says more
    expected = target_unit if spec.metric in ("rmse", "mae") or metric.vector else "1"
    kind = getattr(spec.target, "kind", None)
    if kind in OF_KIND and units.parse(target_unit)[1] != units.parse(OF_KIND[kind])[1]:
        fail("spec.target.unit", f"a {kind} is measured in {OF_KIND[kind]}, not in {target_unit}")
    if units.parse(spec.unit) != units.parse(expected):
        fail("spec.unit", f"{spec.metric} of a target in {target_unit} is in {expected}, not in {spec.unit}")


@check("task")
def answers_are_in_the_scenes(subject: Subject) -> None:
    """The answer must stand in every recording, each class be taught, and no feature be the answer itself.

    Put the target's name among the labels of every scene and every class into the role train; record the features
    (`observe`), and leave the target's kind out of them.
    """
    spec = subject.spec
    kind = getattr(spec.target, "kind", None)
    given_away = sorted({*spec.features, *spec.optional_features} & {kind, *REFERENCE})
    if given_away:
        fail("spec.features", f"it holds {given_away[0]}, the target's kind or one that the reference records")
    classes: dict[str, set[object]] = {}
    for place, planned in _planned(spec):
        scene = planned.scene
        if not set(spec.features) & set(scene.observe):
            fail(f"{place}.observe", f"{', '.join(scene.observe)}: none of the features {', '.join(spec.features)}")
        if not isinstance(spec.target, LabelTarget):
            continue
        value = scene.labels.get(spec.target.name)
        if value is None:
            there = " or ".join(nearest(spec.target.name, scene.labels) or scene.labels) or "none"
            fail(f"{place}.labels", f"it has no {spec.target.name!r}, which the target asks for; there is {there}")
        if spec.kind == "regression" and (isinstance(value, str) or not math.isfinite(value)):
            fail(f"{place}.labels[{spec.target.name}]", f"{value!r} is no number, and the task is a regression")
        if place.startswith("spec.scenes"):
            classes.setdefault(planned.role, set()).add(value)
    names = [planned.scene.name for planned in spec.scenes]
    for name in names:
        if names.count(name) > 1:
            fail(f"spec.scenes[{name}].name", "two scenes have it: the second overwrites the first")
    roles = {planned.role for planned in spec.scenes}
    missing = sorted({"train", "test"} - roles) if roles and "roles" in spec.splits else []
    if missing:
        fail("spec.scenes", f"none has the role {missing[0]}, which the split `roles` needs")
    taught = classes.get("train", set())
    if spec.kind == "regression" and len(taught) == 1:
        fail("spec.scenes", f"role train teaches one value alone: {min(map(str, taught))}")
    for role, found in classes.items() if spec.kind == "classification" and taught else ():
        if found - taught or len(taught) < 2:
            strange = ", ".join(sorted(map(str, found - taught))) or "one class alone"
            fail("spec.scenes", f"role {role} has {strange}; role train teaches {', '.join(map(str, taught))}")
    if isinstance(spec.target, LabelTarget) and spec.scenes:
        _label_is_one_thing(spec, spec.target)
    if "roles" not in spec.splits or missing:
        return
    tests, training = ([one.scene for one in spec.scenes if one.role == role] for role in ("test", "train"))
    same = [one.model_copy(update={"name": "", "starts_after_s": 0.0}) for one in training]
    for scene in tests:
        if scene.model_copy(update={"name": "", "starts_after_s": 0.0}) in same:
            fail(f"spec.scenes[{scene.name}]", "a scene of training is the same, in the same session")
    sessions = {one.session for one in tests}
    if len(spec.scenes) > 2 and sessions <= {one.session for one in training}:
        fail("spec.scenes.session", f"every test session is one of training: {', '.join(sorted(sessions))}")


def _leaves(given: Any, way: str) -> Iterator[tuple[str, Any]]:
    """Yield the numbers (SI) and texts of a scene's part by their places."""
    if isinstance(given, Quantity):
        yield way, given.value * units.parse(given.unit)[0]
    elif isinstance(given, BaseModel | Mapping):
        for name, one in dict(given).items():
            yield from _leaves(one, f"{way}.{name}")
    elif isinstance(given, str | int | float):
        yield way, given


def _label_is_one_thing(spec: TaskSpec, target: LabelTarget) -> None:
    """Fail where a label goes with two parts of the scenes, so that either gives it away, or is in another unit."""
    scenes = [planned.scene for planned in spec.scenes]
    labels: list[Any] = [scene.labels[target.name] for scene in scenes]
    told: dict[str, str] = {}
    for part in PARTS:
        columns = [dict(_leaves(getattr(scene, part), part)) for scene in scenes]
        for way in columns[0]:
            values = [column.get(way) for column in columns]
            if None in values or len(set(values)) < 2:
                continue
            if _go_together(labels, values):
                told.setdefault(part, way)
            unit = target.unit if "unit" in target.model_fields_set else spec.unit
            pairs = [(label, value) for label, value in zip(labels, values, strict=True) if value]
            if spec.kind != "regression" or unit == "1" or len(pairs) < 2 or isinstance(values[0], str):
                continue
            factors = [label * units.parse(unit)[0] / value for label, value in pairs]
            power = math.log10(abs(factors[0]) or 1.0)
            alike = np.allclose(factors, factors[0], rtol=1e-6, atol=0)
            if alike and abs(power) > 0.5 and math.isclose(power, round(power), abs_tol=1e-6):
                text = f"{pairs[0][0]:g} {unit} where {way} is {pairs[0][1]:g} (SI): which unit?"
                fail(f"spec.scenes.labels[{target.name}]", text)
    if len(scenes) >= LEAST_SCENES and len(told) > 1:
        text = f"{target.name} goes with {' and with '.join(told.values())}: either gives it away"
        fail("spec.scenes", f"{text}; vary one of them independently")


def _go_together(labels: Sequence[Any], values: Sequence[Any]) -> bool:
    """Return whether each label has values of its own: numbers that rise with it, or fall, or one stretch of them."""
    pairs, distinct = sorted(set(zip(values, labels, strict=True))), len(set(labels))
    if isinstance(values[0], str) or (distinct >= LEAST_SCENES and isinstance(labels[0], str)):
        return len(pairs) == len(set(values)) == distinct
    runs = [label for label, _ in itertools.groupby(label for _, label in pairs)]
    ordered = distinct < LEAST_SCENES or runs in (sorted(runs), sorted(runs, reverse=True))
    return len(runs) == distinct <= len(set(values)) and ordered


@check("task")
def scenes_can_be_pressed(subject: Subject) -> None:
    """One scene of a hundred that cannot be carried out ends a campaign when the others are recorded.

    Name installed shapes with dimensions of theirs, and state forces in newtons and lengths in millimetres.
    """
    spec = subject.spec
    if not spec.scenes:
        skip("it has no scenes: recordings made elsewhere answer it")
    for place, planned in _planned(spec):
        body, force_n = planned.scene.indenter, planned.scene.profile.largest_n
        with code_of(f"{place}.indenter", subject):
            if body.shape is not None:
                subject.registry.indenters[body.shape].sizes(body.dimensions)
        if body.radius is not None and not LEAST_M <= body.radius.to("m") <= LARGEST_M:
            fail(f"{place}.indenter.radius", f"{body.radius} is not within {1e3 * LEAST_M:g} to {1e3 * LARGEST_M:g} mm")
        if force_n > MOST_N:
            fail(f"{place}.profile", f"its largest force is {force_n:g} N: is its unit right?")
        force = getattr(spec.target, "kind", "") == "force"
        if force and force_n / units.conversion(spec.target.unit, "N") < LEAST_FORCE:
            fail("spec.target.unit", f"{force_n:g} N at most is little in {spec.target.unit}: are newtons meant?")


@check("task", needs="answers-are-in-the-scenes")
def its_scene_is_carried_out(subject: Subject) -> None:
    """A scene that no rig can carry out, or whose target no rig records, is found out after those before it.

    Correct what the message names: indenter, placement, slide, effects or profile of the scene, or the target.
    """
    spec = subject.spec
    if not spec.scenes:
        skip("it has no scenes: recordings made elsewhere answer it")
    scene = spec.scenes[0].scene
    slide = scene.slide
    if slide is not None:
        slide = slide.model_copy(update={"start": assumed(SECONDS / 2, "s", WHY), "duration": None})
    kept = {field: getattr(scene, field) for field in
            ("indenter", "placement", "observe", "labels", "drive", "simulation")}  # fmt: skip
    press = next(presses(subject, (tiny_scene(slide=slide, **kept),), f"spec.scenes[{scene.name}]"), None)
    if press is None:
        skip("no sensor that can be simulated goes with it: it needs another rig, or recordings")
    channels = [channel for stream in press.meta.reference for channel in stream.channels]
    for one in getattr(spec.target, "components", (spec.target,)):
        names = [channel.name for channel in channels if channel.kind == getattr(one, "kind", "")]
        if isinstance(one, ChannelTarget) and (not names or (one.name is not None and one.name not in names)):
            there = ", ".join(f"{channel.name} ({channel.kind})" for channel in channels)
            fail("spec.target", f"no {one.kind} {one.name or ''} is recorded; there is {there}")
