"""Checks of a task: all names in it exist, and its scenes can be carried out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.press import MOST_N, SECONDS, WHY, first_press, tiny_scene
from tactbench.core.errors import nearest
from tactbench.core.evaluation.metrics import METRICS
from tactbench.core.evaluation.protocols import protocol_called, shots
from tactbench.core.evaluation.splits import SPLITS_WITHOUT_GROUPS
from tactbench.core.spec import units
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.task import ChannelTarget, LabelTarget, PlannedScene, TaskSpec

REFERENCE = ("force", "torque", "position")  # kinds of references; as features they would give the answer away
PARTS = {"indenter", "placement", "profile", "slide", "environment"}  # of a scene, that a label may depend on
LEAST_SCENES = 5  # number from which it is no chance that a number rises with a label
LEAST_M, LARGEST_M = 1e-5, 1.0  # radii of caps that are pressed on a sensor
LEAST_FORCE = 0.05  # smallest largest force of the scenes, in the unit of a force target
GROUPS = ("recording", "unit", "trial", "press", "object", "block")  # of recordings or our mappings, beside labels


def _planned(spec: TaskSpec) -> Iterator[tuple[str, PlannedScene]]:
    """Yield every planned scene, with its place in the spec as text."""
    for name, campaign in (("scenes", spec.scenes), *((f"campaigns[{k}]", v) for k, v in spec.campaigns.items())):
        for planned in campaign:
            yield f"spec.{name}[{planned.scene.name}]", planned


@check("task")
def names_are_known(subject: Subject) -> None:
    """Protocols, splits and estimators are looked up only after everything has been recorded.

    Name protocols of docs/protocols.md, splits that its recordings serve, and estimators and baselines of its kind.
    """
    spec = subject.spec
    missing = set(get_args(Role)) - {planned.role for planned in spec.scenes} if spec.scenes else set()
    with code_of("spec.protocols", subject):
        for name in spec.protocols:
            if protocol_called(name).roles_only and missing:
                fail("spec.protocols", f"{name} needs recordings of the role {min(missing)}; no scene has this role")
    labels = {label for _, planned in _planned(spec) for label in planned.scene.labels}
    known = {*SPLITS_WITHOUT_GROUPS, *GROUPS, *spec.campaigns, *labels}
    for name in spec.splits:
        # Without scenes, a group may be any annotation of recordings that others have made.
        if name not in known and shots(name) is None and (spec.scenes or nearest(name, known)):
            fail("spec.splits", f"recordings of this task allow no split {name!r}, only {', '.join(sorted(known))}")
    for field in ("estimators", "baselines"):
        with code_of(f"spec.{field}", subject):
            for found in [subject.registry.estimators[name] for name in getattr(spec, field)]:
                if spec.kind not in found.kinds or found.baseline < (field == "baselines"):
                    fail(f"spec.{field}", f"{found.name} is not a baseline, or not for {spec.kind}")


@check("task")
def metric_has_its_unit(subject: Subject) -> None:
    """A task's metric must suit the kind of task, and the unit shown beside its scores must be that of the metric.

    For errors (rmse, mae, mean_euclidean_error), which are not converted, state the target's unit; else state 1.
    """
    spec = subject.spec
    metric = METRICS[spec.metric]
    if metric.kind != spec.kind:
        fail("spec.metric", f"{spec.metric} is for {metric.kind}, and the task is a {spec.kind}")
    target_unit = getattr(spec.target, "unit", "1")  # frames that slip or do not have none
    if isinstance(spec.target, LabelTarget) and "unit" not in spec.target.model_fields_set:
        target_unit = spec.unit
    expected = target_unit if spec.metric in ("rmse", "mae") or metric.vector else "1"
    if units.parse(spec.unit) != units.parse(expected):
        fail("spec.unit", f"{spec.metric} of a target in {target_unit} is in {expected}, not in {spec.unit}")


@check("task")
def answers_are_in_the_scenes(subject: Subject) -> None:
    """Every recording must contain the target, training data every class, and no feature may be the target itself.

    Put the target's name among the labels of every scene and every class into the role train; record the features
    (`observe`), and leave the target's kind out of them.
    """
    spec, target = subject.spec, subject.spec.target
    given_away = {*spec.features, *spec.optional_features} & {getattr(target, "kind", None), *REFERENCE}
    if given_away:
        fail("spec.features", f"{min(given_away)} is the target's kind, or one that the reference records")
    for place, planned in _planned(spec):
        scene = planned.scene
        if not set(spec.features) & set(scene.observe):
            fail(f"{place}.observe", f"{', '.join(scene.observe)}: none of the features {', '.join(spec.features)}")
        if isinstance(target, LabelTarget) and target.name not in scene.labels:
            there = " or ".join(nearest(target.name, scene.labels) or scene.labels) or "none"
            fail(f"{place}.labels", f"the task's target {target.name!r} is missing; there is {there}")
    names = [planned.scene.name for planned in spec.scenes]
    for name in names:
        if names.count(name) > 1:
            fail(f"spec.scenes[{name}].name", "two scenes have this name: the second overwrites the first")
    if isinstance(target, LabelTarget) and spec.scenes:
        taught = {planned.scene.labels[target.name] for planned in spec.scenes if planned.role == "train"}
        strange = {planned.scene.labels[target.name] for planned in spec.scenes} - taught
        if len(taught) == 1 or (spec.kind == "classification" and taught and strange):
            text = f"role train has the labels {', '.join(map(str, taught))} only; other roles have"
            fail("spec.scenes", f"{text} {', '.join(sorted(map(str, strange))) or 'the same'}")
        _label_is_one_thing(spec, target)
    if "roles" not in spec.splits:
        return
    tests, training = (
        [one.scene.model_copy(update={"name": "", "starts_after_s": 0.0}) for one in spec.scenes if one.role == role]
        for role in ("test", "train")
    )
    sessions = {one.session for one in tests}
    if any(one in training for one in tests):
        fail("spec.scenes", "a scene of the role test is also a training scene, in the same session")
    if len(spec.scenes) > 2 and sessions <= {one.session for one in training}:
        fail("spec.scenes.session", f"every test session is also a training session: {', '.join(sorted(sessions))}")


def _leaves(given: Mapping[str, Any], way: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the numbers (in SI units) and texts in a pydantic model's data, each with the path of its field."""
    for name, one in given.items():
        if isinstance(one, Mapping) and "unit" in one:
            yield f"{way}{name}", one["value"] * units.parse(one["unit"])[0]
        elif isinstance(one, Mapping):
            yield from _leaves(one, f"{way}{name}.")
        elif isinstance(one, str | int | float):
            yield f"{way}{name}", one


def _label_is_one_thing(spec: TaskSpec, target: LabelTarget) -> None:
    """Fail if two parts of the scenes each determine the label, or if the label is in another unit."""
    scenes = [planned.scene for planned in spec.scenes]
    labels: list[Any] = [scene.labels[target.name] for scene in scenes]
    unit = target.unit if "unit" in target.model_fields_set else spec.unit
    columns = [dict(_leaves(scene.model_dump(include=PARTS))) for scene in scenes]
    parts: dict[str, str] = {}
    for place in columns[0]:
        values = [column.get(place) for column in columns]
        if None in values or len(set(values)) < 2:
            continue
        if _go_together(labels, values):
            parts.setdefault(place.partition(".")[0], place)
        if spec.kind != "regression" or unit == "1" or isinstance(values[0], str):
            continue
        factors = [label * units.parse(unit)[0] / value for label, value in zip(labels, values, strict=True) if value]
        power = math.log10(abs(factors[0]) or 1.0)
        if np.allclose(factors, factors[0], rtol=1e-6, atol=0) and power and math.isclose(power, round(power)):
            fail(f"spec.scenes.labels[{target.name}]", f"it is {factors[0]:g} times {place}, in SI units: which unit?")
    if len(scenes) >= LEAST_SCENES and len(parts) > 1:
        text = f"{target.name} varies with {' and with '.join(parts.values())}: each reveals it"
        fail("spec.scenes", f"{text}; vary one part independently")


def _go_together(labels: Sequence[Any], values: Sequence[Any]) -> bool:
    """Return True if two series of numbers rise and fall together, or always in opposite directions."""
    ranks = [np.unique(one, return_inverse=True)[1].astype(int) for one in (labels, values)]
    signs = math.prod(np.sign(np.subtract.outer(one, one)) for one in ranks)
    return bool(np.any(signs) and (np.min(signs) >= 0 or np.max(signs) <= 0))


@check("task", needs="answers-are-in-the-scenes")
def scenes_can_be_pressed(subject: Subject) -> None:
    """One scene in a hundred that cannot be carried out stops a campaign after the others are recorded.

    Name installed shapes with dimensions of theirs, and state forces in newtons and lengths in millimetres. Correct
    the part in the message: indenter, placement, slide or effects of the scene, or the target.
    """
    spec = subject.spec
    if not spec.scenes:
        skip("the task has no scenes: it needs recordings made elsewhere")
    force = getattr(spec.target, "kind", "") == "force"
    least_n = LEAST_FORCE * units.conversion(spec.target.unit, "N") if force else 0.0
    for place, planned in _planned(spec):
        body, force_n = planned.scene.indenter, planned.scene.profile.largest_n
        with code_of(f"{place}.indenter", subject):
            if body.shape is not None:
                subject.registry.indenters[body.shape].sizes(body.dimensions)
        if body.radius is not None and not LEAST_M <= body.radius.to("m") <= LARGEST_M:
            fail(f"{place}.indenter.radius", f"{body.radius} is not within {1e3 * LEAST_M:g} to {1e3 * LARGEST_M:g} mm")
        if not least_n <= force_n <= MOST_N:
            fail(f"{place}.profile", f"the largest force is {force_n:g} N: is its unit, and that of the target, right?")
    _check_first_press(subject, spec.scenes[0].scene)


def _check_first_press(subject: Subject, scene: Scene) -> None:
    """Fail if a scene cannot be simulated, or if the target is not recorded."""
    tiny, slide = tiny_scene(), scene.slide
    if slide is not None:
        slide = slide.model_copy(update={"start": assumed(SECONDS / 2, "s", WHY), "duration": None})
    kept = {"profile": tiny.profile, "environment": tiny.environment, "slide": slide}
    press = first_press(subject, scene.model_copy(update=kept), f"spec.scenes[{scene.name}]")
    recorded = [(channel.kind, channel.name) for stream in press.meta.reference for channel in stream.channels]
    target = subject.spec.target
    for one in getattr(target, "components", (target,)):
        if isinstance(one, ChannelTarget) and not any(one.kind == k and one.name in (None, n) for k, n in recorded):
            there = ", ".join(f"{name} ({kind})" for kind, name in recorded)
            fail("spec.target", f"no {one.kind} {one.name or ''} is recorded; recorded: {there}")
