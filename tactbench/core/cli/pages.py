"""What `show` prints of all but sensors: a short page of titled lines and small tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tactbench.core.evaluation.protocols import PROTOCOLS, shots
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, METRIC_NAMES
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.parameter import Parameter
from tactbench.core.spec.rig import (
    DeviceDescriptor,
    EffectDescriptor,
    EstimatorDescriptor,
    IndenterDescriptor,
    ProfileDescriptor,
    RigDescriptor,
)
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.task import ChannelTarget, Published, TaskSpec, VectorTarget
from tactbench.core.tables.numbers import suffix

Pair = tuple[str, str]

_SPLITS = {
    "roles": "trained on scenes of role train, tested on those of role test",
    "session": "one session after the other is left out",
    "in-session": "first 80 % of each recording against its last 20 %",
    "shuffled": "rows at random: leaks, and is stamped so",
}


@dataclass(frozen=True)
class Section:
    """Lines of two columns, or a table with a head."""

    title: str
    lines: Sequence[Sequence[str]]
    head: Sequence[str] = ()


@dataclass(frozen=True)
class Page:
    """A page for people."""

    title: str
    sections: list[Section] = field(default_factory=list)


def task_page(task: TaskSpec) -> Page:
    """Return what a task asks, of which recordings, under which rules, and what others have published."""
    direction = "lower" if task.metric in LOWER_IS_BETTER else "higher"
    facts = [
        ("question", task.question),
        ("target", _target(task)),
        *([("one answer", f"a {task.answer_per}, from {task.answer_from}")] if task.answer_per != "sample" else []),
        ("looks at", f"channels of kind {', '.join(task.features)}{_where_there(task.optional_features)}"),
        ("metric", f"{METRIC_NAMES.get(task.metric, task.metric)}{suffix(task.unit)}, {direction} is better"),
        ("the same in practice", "nobody has said" if task.equivalence is None
                                 else f"a difference of up to {task.equivalence:g}{suffix(task.unit)}"),
        ("estimators", f"{', '.join(task.estimators)} when none is asked for"),
        ("baselines", f"{', '.join(task.baselines)}: trivial answers, in every table"),
    ]  # fmt: skip
    page = Page(f"Task {task.name}: {task.title}", [Section("", facts)])
    page.sections.append(
        Section("Recordings", _scenes(task), ("role", "scenes", "indenter", "placement", "force", "duration"))
        if task.scenes
        else Section("Recordings", [("", "made elsewhere: run it with --rig replay --recordings DIR")])
    )
    page.sections.append(Section("Protocols, the default first", [(name, _protocol(name)) for name in task.protocols]))
    if task.splits:
        page.sections.append(Section("Splits, the default first", [(name, _split(task, name)) for name in task.splits]))
    if task.published:
        page.sections.append(Section("Published", [_published(one, task.unit) for one in task.published]))
    return page


MOST_PLACES = 8
"""That are named one by one."""


def _where_there(kinds: Sequence[str]) -> str:
    return f"; where a sensor has them {', '.join(kinds)}" if kinds else ""


def _target(task: TaskSpec) -> str:
    if isinstance(task.target, ChannelTarget):
        name = f" {task.target.name}" if task.target.name else ""
        return f"reference channel{name} of kind {task.target.kind}, in {task.target.unit}, sample by sample"
    if isinstance(task.target, SlipTarget):
        what = "when slip begins" if task.kind == "events" else "stick, incipient or gross slip"
        return f"{what}, by the reference alone; {task.target}"
    if isinstance(task.target, VectorTarget):
        names = ", ".join(task.target.names)
        return (
            f"vector ({names}): reference channels of kind {task.target.kind}, in {task.target.unit}, sample by sample"
        )
    what = "a class" if task.kind == "classification" else "a number"
    return f"{what}: label {task.target.name}{f', in {task.target.unit}' if task.target.unit != '1' else ''}"


def _scenes(task: TaskSpec) -> list[tuple[str, ...]]:
    """Return one line for each role and indenter with equal force profiles, with how many scenes there are."""
    scenes = [(str(planned.role), *_scene(planned.scene)) for planned in task.scenes]
    places: dict[tuple[str, ...], set[str]] = {}
    for *way, where, force, duration in scenes:
        places.setdefault((*way, force, duration), set()).add(where)
    counts: Counter[tuple[str, ...]] = Counter()
    for *way, where, force, duration in scenes:
        several = len(places[*way, force, duration])
        counts[*way, where if several <= MOST_PLACES else f"{several} places", force, duration] += 1
    merged: dict[tuple[str, ...], tuple[int, list[str]]] = {}
    for (role, indenter, *rest), count in counts.items():
        number, indenters = merged.get((role, *rest), (0, []))
        merged[role, *rest] = (number + count, [*indenters, indenter])
    return [
        (role, str(number), ", ".join(indenters).replace(" mm, cap R", ","), *rest)
        for (role, *rest), (number, indenters) in merged.items()
    ]


def _scene(scene: Scene) -> tuple[str, str, str, str]:
    place, profile = scene.placement, scene.profile
    nominal = place.x.value == 0 and place.s.value == 0
    where = "nominal" if nominal else f"{place.x} along, {place.s} across"
    scatter = f", scatter {place.scatter}" if place.scatter.value else ""
    slide = f", slides at {scene.slide.speed}" if scene.slide else ""
    end = profile.end if profile.kind == "ramp" else f"{profile.largest_n:g} N, by a path"
    force = f"{profile.start.value:g} to {end}, after {profile.hold}"
    return str(scene.indenter), where + scatter, force + slide, str(profile.duration)


def _protocol(name: str) -> str:
    if name not in PROTOCOLS:
        return ""
    spec = PROTOCOLS[name]
    return spec.title + (" (uses test-set statistics: †)" if spec.uses_test_statistics else "")


def _split(task: TaskSpec, name: str) -> str:
    number = shots(name)
    text = f"{number} training session{'s' if number > 1 else ''}" if number else _SPLITS.get(name)
    own = f", of {len(task.campaigns[name])} scenes of its own" if name in task.campaigns else ""
    return (
        text or (f"one {name} after the other is left out" if own else f"five folds of whole groups `{name}`")
    ) + own


def _published(one: Published, unit: str) -> Pair:
    whose = "/".join(filter(None, (one.sensor or "any sensor", one.estimator or "their own model")))
    remark = f" ({one.remark})" if one.remark else ""
    return f"{one.score:g}{suffix(unit)}", f"{whose}, {one.protocol}: {one.reference}{remark}"


def estimator_page(estimator: EstimatorDescriptor) -> Page:
    """Return what an estimator answers, and what may be set."""
    answers = {"features": "the features", "time": "the time index alone", "nothing": "nothing",
               "reference": "the reference sensor: an oracle"}  # fmt: skip
    grid = [f"{name}: {', '.join(f'{one:g}' for one in values)}" for name, values in estimator.grid.items()]
    if estimator.window_grid != (0,):
        grid.append(f"window: {', '.join(map(str, estimator.window_grid))} samples before the newest")
    linear = {True: "linear", False: "not linear", None: "not said"}[estimator.linear]
    facts = [
        ("answers", " and ".join(estimator.kinds)),
        ("looks at", answers[estimator.looks_at]),
        ("model", linear + (", a trivial answer" if estimator.baseline else "")),
        ("may be set", ", ".join(f"{name}={value}" for name, value in estimator.params.items()) or "nothing"),
        ("chosen on validation data", "; ".join(grid) or "nothing"),
        ("code", estimator.where),
    ]
    return Page(f"Estimator {estimator.name}: {estimator.title}", [Section("", facts)])


def rig_page(rig: RigDescriptor) -> Page:
    """Return what a rig is, and what it can do beside carrying out scenes."""
    able = [name.replace("_", " ") for name in ("verification", "work_precision", "likeness") if getattr(rig, name)]
    facts = [
        ("scenes are", "simulated; rows are marked SIM" if rig.simulated else "carried out on hardware, or were"),
        ("solvers", ", ".join(rig.rungs) or "none"),
        ("also offers", ", ".join(able) or "nothing"),
        ("code", rig.where),
    ]
    return Page(f"Rig {rig.name}: {rig.title}", [Section("", facts)])


def effect_page(effect: EffectDescriptor) -> Page:
    """Return what an effect makes of what, and when it is asked."""
    facts = [
        ("produces", ", ".join(effect.produces) or "nothing"),
        ("consumes", ", ".join(effect.consumes) or "nothing"),
        ("groups", ", ".join(effect.groups) or "none"),
        ("code", effect.where),
    ]
    return Page(f"Effect {effect.name}: {effect.title}", [Section("", facts)])


def indenter_page(indenter: IndenterDescriptor) -> Page:
    """Return by which dimensions an indenter is given."""
    return _given_by(f"Indenter {indenter.name}: {indenter.title}", "--indenter", indenter, indenter.dimensions)


def profile_page(profile: ProfileDescriptor) -> Page:
    """Return by which parameters a force profile is given."""
    return _given_by(f"Profile {profile.name}: {profile.title}", "--profile", profile, profile.parameters)


def _given_by(
    title: str, option: str, descriptor: IndenterDescriptor | ProfileDescriptor, numbers: Mapping[str, Parameter]
) -> Page:
    asked = ",".join(f"{name}={one.default:g}" for name, one in numbers.items())
    facts = [
        ("asked for", f"tactbench record {option} {descriptor.name}{f':{asked}' if asked else ''}"),
        ("code", descriptor.where),
    ]
    page = Page(title, [Section("", facts)])
    if numbers:
        lines = [(name, f"{one.default:g}", one.unit, one.range, one.text) for name, one in numbers.items()]
        page.sections.append(Section("Given by", lines, ("name", "default", "unit", "may be", "what it is")))
    return page


def device_page(device: DeviceDescriptor) -> Page:
    """Return what a device is for, and where its code is."""
    facts = [("used for", device.kind), ("driver", device.driver), ("emulator", device.emulator or "none")]
    return Page(f"Device {device.name}: {device.title}", [Section("", facts)])


def page_of(descriptor: Any) -> Page:
    """Return the page of a descriptor of any kind but a sensor."""
    if isinstance(descriptor, EstimatorDescriptor):
        return estimator_page(descriptor)
    if isinstance(descriptor, RigDescriptor):
        return rig_page(descriptor)
    if isinstance(descriptor, EffectDescriptor):
        return effect_page(descriptor)
    if isinstance(descriptor, IndenterDescriptor):
        return indenter_page(descriptor)
    if isinstance(descriptor, ProfileDescriptor):
        return profile_page(descriptor)
    if isinstance(descriptor, DeviceDescriptor):
        return device_page(descriptor)
    return task_page(descriptor.spec)
