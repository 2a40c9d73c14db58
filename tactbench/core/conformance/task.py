"""Checks of a task: every name it uses exists, and its scenes can be carried out."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

from tactbench.core.conformance.check import check, code_of, fail, skip
from tactbench.core.conformance.sensor_spec import OF_KIND
from tactbench.core.conformance.subject import Subject
from tactbench.core.conformance.trial_press import SECONDS, TrialPress, first_that_goes, tiny_scene
from tactbench.core.errors import UnknownNameError, UsageError, nearest
from tactbench.core.spec import units
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.task import ChannelTarget, LabelTarget, PlannedScene, TaskSpec

GROUPS = ("recording", "unit", "trial", "press", "object", "block")
"""Groups beside labels that recordings have or that mappings of this package give them."""
_FOREIGN = re.compile(r"fold|leave|random|cross|hold|loo\b|few")
"""Names that other libraries have for splits, and few shots without a number."""
SAME_NUMBER = 1e-9


def _planned(spec: TaskSpec) -> Iterator[tuple[str, PlannedScene]]:
    """Yield every planned scene with its place."""
    for planned in spec.scenes:
        yield f"spec.scenes[{planned.scene.name}]", planned
    for name, campaign in spec.campaigns.items():
        for planned in campaign:
            yield f"spec.campaigns[{name}][{planned.scene.name}]", planned


@check("task")
def metric_is_known(subject: Subject) -> None:
    """The metric is looked up when everything has been recorded and taught.

    Name one of the metrics of docs/glossary.md that fits the kind of question.
    """
    from tactbench.core.evaluation.metrics import METRICS, metric_called

    spec = subject.descriptor.spec
    try:
        metric = metric_called(spec.metric)
    except UnknownNameError as error:
        fail("spec.metric", str(error))
    if metric.kind != spec.kind:
        fitting = ", ".join(name for name, one in METRICS.items() if one.kind == spec.kind)
        fail("spec.metric", f"{spec.metric} is for {metric.kind}, the task is a {spec.kind}; there are {fitting}")


@check("task", needs=("metric-is-known",))
def metric_has_its_unit(subject: Subject) -> None:
    """The unit stands beside every score: errors are computed in the target's unit, and nobody converts them.

    State the target's unit for errors (rmse, mae, mean_euclidean_error), and 1 for the others.
    """
    from tactbench.core.evaluation.metrics import METRICS

    spec = subject.descriptor.spec
    target_unit = getattr(spec.target, "unit", "1")  # frames that slip or do not have none
    for field, unit in (("spec.unit", spec.unit), ("spec.target.unit", target_unit)):
        try:
            units.parse(unit)
        except UsageError as error:
            fail(field, str(error))
    if isinstance(spec.target, LabelTarget) and "unit" not in spec.target.model_fields_set:
        target_unit = spec.unit  # a label of which nobody says more
    of_the_target = spec.metric in ("rmse", "mae") or METRICS[spec.metric].vector
    expected = target_unit if of_the_target else "1"
    kind = getattr(spec.target, "kind", None)
    if kind in OF_KIND and units.parse(target_unit)[1] != units.parse(OF_KIND[kind])[1]:
        fail("spec.target.unit", f"a {kind} is measured in {OF_KIND[kind]}, not in {target_unit}")
    if units.parse(spec.unit) != units.parse(expected):
        fail("spec.unit", f"{spec.metric} of a target in {target_unit} is in {expected}, not in {spec.unit}")


@check("task")
def protocols_are_known(subject: Subject) -> None:
    """A protocol is looked up when its cell's turn comes.

    Name protocols of docs/protocols.md.
    """
    from tactbench.core.evaluation.protocols import protocol_called

    spec = subject.descriptor.spec
    if not spec.protocols:
        fail("spec.protocols", "it is empty: the first is the default")
    for number, name in enumerate(spec.protocols):
        try:
            rules = protocol_called(name)
        except UnknownNameError as error:
            fail(f"spec.protocols[{number}]", str(error))
        if (rules.three_sigma or rules.discard_samples) and (spec.summaries or spec.features_by):
            fail(f"spec.protocols[{number}]", f"{name} drops single samples, and the task summarises whole recordings")


@check("task")
def splits_are_known(subject: Subject) -> None:
    """A split that no recording can serve turns every cell into SKIPPED.

    Name roles, session, in-session, shuffled, few-shot-N, a campaign of the task, or a label of its scenes.
    """
    from tactbench.core.evaluation.protocols import shots
    from tactbench.core.evaluation.splits import SPLITS_WITHOUT_GROUPS

    spec = subject.descriptor.spec
    labels = {label for _, planned in _planned(spec) for label in planned.scene.labels}
    known = {*SPLITS_WITHOUT_GROUPS, *GROUPS, *spec.campaigns, *labels}
    for number, name in enumerate(spec.splits):
        if name in known or shots(name) is not None:
            continue
        # Without scenes, a group may be any annotation of recordings that others have made.
        close = nearest(name, known)
        if spec.scenes or _FOREIGN.search(name) or any(_alike(name, one) for one in close):
            fail(f"spec.splits[{number}]", f"{name!r} is no split that recordings of this task could serve"
                 + (f"; did you mean {' or '.join(close)}?" if close else ""))  # fmt: skip
    if not spec.splits and any(name.startswith("deployable") for name in spec.protocols):
        fail("spec.splits", "it is empty, and the protocol deployable needs one")


def _alike(given: str, known: str) -> bool:
    import difflib

    return difflib.SequenceMatcher(None, given, known).ratio() > 0.8


@check("task")
def campaigns_are_splits(subject: Subject) -> None:
    """A campaign is recorded for the split of its name; under another name it is never asked for.

    Add the campaign's name to splits, or remove the campaign.
    """
    spec = subject.descriptor.spec
    for name in spec.campaigns:
        if name not in spec.splits:
            fail(f"spec.campaigns[{name}]", "it is none of the task's splits")


@check("task")
def estimators_are_installed(subject: Subject) -> None:
    """An estimator that is not installed, or answers another kind of question, fails after everything is recorded.

    Name estimators of `tactbench list estimators` that have the task's kind.
    """
    _estimators(subject, "estimators")


@check("task")
def baselines_are_installed(subject: Subject) -> None:
    """Every table says what a trivial answer gets; without a baseline nobody sees what a score is worth.

    Name baselines that have the task's kind: mean, time-index, majority, chance.
    """
    _estimators(subject, "baselines")
    spec = subject.descriptor.spec
    for number, name in enumerate(spec.baselines):
        if not subject.registry.estimators[name].baseline:
            fail(f"spec.baselines[{number}]", f"{name} is no trivial answer by its own account")


def _estimators(subject: Subject, field: str) -> None:
    spec = subject.descriptor.spec
    names: Sequence[str] = getattr(spec, field)
    if not names:
        fail(f"spec.{field}", "it is empty")
    for number, name in enumerate(names):
        try:
            kinds = subject.registry.estimators[name].kinds
        except UnknownNameError as error:
            fail(f"spec.{field}[{number}]", str(error))
        if spec.kind not in kinds:
            fail(f"spec.{field}[{number}]", f"{name} is for {' and '.join(kinds)}, and the task is a {spec.kind}")


@check("task", may_skip=True)
def labels_are_in_the_scenes(subject: Subject) -> None:
    """The answer asked for must stand in every recording: a misspelt label is no answer at all.

    Put the target's name among the labels of every scene; numbers for regression.
    """
    spec = subject.descriptor.spec
    if not isinstance(spec.target, LabelTarget):
        skip("its target is a channel")
    if not spec.scenes:
        skip("it has no scenes: recordings made elsewhere bring the labels")
    for place, planned in _planned(spec):
        labels = planned.scene.labels
        if spec.target.name not in labels:
            close = nearest(spec.target.name, labels)
            there = f"; there is {' or '.join(close or labels) or 'none'}"
            fail(f"{place}.labels", f"it has no {spec.target.name!r}, which the target asks for{there}")
        value = labels[spec.target.name]
        if spec.kind == "regression" and (isinstance(value, str) or not math.isfinite(value)):
            fail(f"{place}.labels[{spec.target.name}]", f"{value!r} is no number, and the task is a regression")


@check("task", needs=("labels-are-in-the-scenes",))
def classes_can_be_told_apart(subject: Subject) -> None:
    """A class that is tested and never taught cannot be answered, and one class alone is no question.

    Record every class for every role.
    """
    spec = subject.descriptor.spec
    if spec.kind != "classification":
        skip("it is a regression")
    of_role: dict[str, set[object]] = {}
    for planned in spec.scenes:
        of_role.setdefault(planned.role, set()).add(planned.scene.labels[spec.target.name])
    taught = of_role.get("train", set())
    if len(taught) < 2:
        fail("spec.scenes", f"scenes of role train have {len(taught)} class of {spec.target.name}; 2 are needed")
    for role, classes in of_role.items():
        if classes - taught:
            fail("spec.scenes", f"role {role} has {sorted(map(str, classes - taught))[0]}, which is never taught")


@check("task", may_skip=True)
def roles_are_complete(subject: Subject) -> None:
    """A split by roles needs recordings to teach with and others to test on.

    Give scenes the roles train and test, and validation for the protocols of the paper.
    """
    from tactbench.core.evaluation.protocols import PROTOCOLS

    spec = subject.descriptor.spec
    if not spec.scenes:
        skip("it has no scenes")
    roles = {planned.role for planned in spec.scenes}
    needed = {"train", "test"} if "roles" in spec.splits else set()
    if any(PROTOCOLS[name].roles_only for name in spec.protocols if name in PROTOCOLS):
        needed |= {"train", "validation", "test"}
    missing = sorted(needed - roles)
    if missing:
        fail("spec.scenes", f"none has the role {missing[0]}, which its protocols or splits need")


@check("task", may_skip=True)
def scenes_are_named_once(subject: Subject) -> None:
    """Scenes of one name are one scene, recorded once: two that differ overwrite each other.

    Give every scene of a campaign a name of its own; scenes of one name must be the same in all campaigns.
    """
    spec = subject.descriptor.spec
    if not spec.scenes and not spec.campaigns:
        skip("it has no scenes")
    for where, campaign in (
        ("spec.scenes", spec.scenes),
        *((f"spec.campaigns[{k}]", v) for k, v in spec.campaigns.items()),
    ):
        names = [planned.scene.name for planned in campaign]
        doubled = [name for name in names if names.count(name) > 1]
        if doubled:
            fail(f"{where}[{doubled[0]}].name", "two scenes have it")
        for name in names:
            if not re.fullmatch(r"[^\s./\\][^\s/\\]*", name):
                fail(
                    f"{where}[{name}].name",
                    "it is part of a file's name: no blanks, no slashes and no dot at its beginning",
                )


@check("task", may_skip=True)
def scenes_observe_the_features(subject: Subject) -> None:
    """A kind of channel that no scene observes is not recorded, and cannot be a feature.

    Add the task's features to `observe` of its scenes.
    """
    spec = subject.descriptor.spec
    if not spec.scenes:
        skip("it has no scenes")
    for place, planned in _planned(spec):
        if not set(spec.features) & set(planned.scene.observe):
            fail(
                f"{place}.observe",
                f"{', '.join(planned.scene.observe)}: none of the features {', '.join(spec.features)}",
            )


@check("task")
def answer_is_not_a_feature(subject: Subject) -> None:
    """A task whose features hold its target is solved by copying.

    Remove the target's kind from features.
    """
    spec = subject.descriptor.spec
    if getattr(spec.target, "kind", None) in spec.features:
        fail("spec.features", f"it holds {spec.target.kind}, which is the target's kind")
    if len(set(spec.features)) < len(spec.features) or not spec.features:
        fail("spec.features", f"{spec.features}: at least one kind is needed, each once")


@check("task", needs=("code-names-resolve",))
def features_by_gives_features(subject: Subject) -> None:
    """A task's own features are computed from recordings, when all of them have been made.

    Return a mapping of names to finite numbers, the same names for every recording.
    """
    import numpy as np

    from tactbench.core.samples import StreamReadings

    spec = subject.descriptor.spec
    if spec.features_by is None:
        skip("it has no features of its own")
    compute = subject.code("features_by")
    given = []
    for seed, rows in ((0, 200), (1, 150)):
        rng = np.random.default_rng(seed)
        data = 100.0 + rng.normal(size=(rows, 3))
        data[:, 2] = 100.0  # a channel that never changes
        readings = StreamReadings(
            "taxels", ("t1", "t2", "t3"), (spec.features[0],) * 3, data, np.arange(rows) / 100.0, 100.0
        )
        before = data.copy()
        with code_of("spec.features_by", subject.package), np.errstate(all="ignore"):
            given.append(dict(compute((readings,))))
        if not np.array_equal(before, data):
            fail("spec.features_by", "it has changed the readings")
        for name, value in given[-1].items():
            if not isinstance(name, str) or not np.isscalar(value) or not math.isfinite(float(value)):  # type: ignore[arg-type]
                fail(f"spec.features_by: {name}", f"{value!r} is no finite number")
    if not given[0]:
        fail("spec.features_by", "it gave no feature")
    if list(given[0]) != list(given[1]):
        fail("spec.features_by", "it gave other names, or in another order, for another recording")


@check("task", may_skip=True)
def published_figures_are_comparable(subject: Subject) -> None:
    """A published figure stands beside rows of its protocol, sensor and estimator; a misspelt one stands nowhere.

    Name a protocol of the task, and installed estimators and sensors.
    """
    spec = subject.descriptor.spec
    if not spec.published:
        skip("it states no published figures")
    for number, one in enumerate(spec.published):
        where = f"spec.published[{number}]"
        if one.protocol not in spec.protocols:
            fail(f"{where}.protocol", f"{one.protocol!r} is none of the task's protocols")
        if one.estimator is not None and one.estimator not in subject.registry.estimators:
            fail(f"{where}.estimator", f"no estimator {one.estimator!r} is installed")
        if one.split is not None and one.split not in spec.splits:
            fail(f"{where}.split", f"{one.split!r} is none of the task's splits")
        if not math.isfinite(one.score):
            fail(f"{where}.score", f"{one.score} is no finite number")


@check("task", needs=("scenes-observe-the-features",), level="silver")
def its_scene_is_carried_out(subject: Subject) -> None:
    """A scene that no rig can carry out is found out after those before it.

    Correct what the message names: indenter, placement, slide or effects of the scene.
    """
    spec = subject.descriptor.spec
    if not spec.scenes:
        skip("it has no scenes")
    # A recording of zero samples, or of a force below 0, is not found out by a shorter one.
    for place, planned in _planned(spec):
        ramp = planned.scene.profile
        if not ramp.duration.to("s") > 0 or min(ramp.start.to("N"), ramp.end.to("N"), ramp.hold.to("s")) < 0:
            fail(f"{place}.profile", "a duration above 0, and forces and a hold of 0 or more are needed")
    if _pressed(subject) is None:
        skip("no sensor that can be simulated goes with it: it needs another rig, or recordings")


@lru_cache(maxsize=2)
def _pressed(subject: Subject) -> TrialPress | None:
    """Return the task's first scene, cut short, on the first simulated sensor that goes with it."""
    scene = subject.descriptor.spec.scenes[0].scene
    slide = scene.slide
    if slide is not None:
        half = assumed(SECONDS / 2, "s", "a check of plugins")
        slide = slide.model_copy(update={"start": half, "duration": None})
    tiny = tiny_scene(
        indenter=scene.indenter, placement=scene.placement, observe=scene.observe, labels=scene.labels,
        drive=scene.drive, simulation=scene.simulation, slide=slide,
    )  # fmt: skip
    found = first_that_goes(subject, (tiny,), "", f"spec.scenes[{scene.name}]")
    return None if found is None else found[-1]


@check("task", needs=("its-scene-is-carried-out",), level="silver")
def its_target_is_recorded(subject: Subject) -> None:
    """A target that no rig records leaves rows without an answer, after everything was recorded.

    Name a channel that a rig's reference has: fz of kind force, or what its plan adds in the task's scenes.
    """
    spec = subject.descriptor.spec
    targets = getattr(spec.target, "components", (spec.target,))
    press = _pressed(subject)
    if press is None or not all(isinstance(one, ChannelTarget) for one in targets):
        skip("its target is no channel of the reference")
    channels = [channel for stream in press.reference for channel in stream.channels]
    for one in targets:
        names = [channel.name for channel in channels if channel.kind == one.kind]
        if not names or (one.name is not None and one.name not in names):
            there = ", ".join(f"{channel.name} ({channel.kind})" for channel in channels)
            fail("spec.target", f"no {one.kind} {one.name or ''} is recorded; there is {there}")


CHECKS = (
    metric_is_known, metric_has_its_unit, protocols_are_known, splits_are_known, campaigns_are_splits,
    estimators_are_installed, baselines_are_installed, labels_are_in_the_scenes, classes_can_be_told_apart,
    roles_are_complete, scenes_are_named_once, scenes_observe_the_features, answer_is_not_a_feature,
    features_by_gives_features, published_figures_are_comparable, its_scene_is_carried_out,
    its_target_is_recorded,
)  # fmt: skip
