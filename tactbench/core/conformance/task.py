"""Checks of a task: every name it uses exists, and its scenes can be carried out."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.press import SECONDS, WHY, presses, tiny_scene
from tactbench.core.conformance.sensor_spec import OF_KIND
from tactbench.core.errors import nearest
from tactbench.core.spec import units
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.task import ChannelTarget, LabelTarget, PlannedScene, TaskSpec

GROUPS = ("recording", "unit", "trial", "press", "object", "block")
"""Groups beside labels that recordings have or that mappings of this package give them."""


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
    with code_of("spec.protocols", subject):
        for name in spec.protocols:
            protocol_called(name)
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
    if kind in spec.features:
        fail("spec.features", f"it holds {kind}, which is the target's kind")
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
    if spec.kind == "classification" and taught:
        for role, found in classes.items():
            if found - taught or len(taught) < 2:
                strange = ", ".join(sorted(map(str, found - taught))) or "one class alone"
                fail("spec.scenes", f"role {role} has {strange}; role train teaches {', '.join(map(str, taught))}")


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
