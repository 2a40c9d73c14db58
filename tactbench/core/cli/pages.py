"""What `show` prints of all but sensors: a short page of titled lines and small tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

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
    TaskDescriptor,
)
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.task import ChannelTarget, Published, TaskSpec, VectorTarget
from tactbench.core.tables.numbers import suffix

_SPLITS = {
    "roles": "trained on scenes of role train, tested on those of role test",
    "session": "one session after the other is left out",
    "in-session": "first 80 % of each recording against its last 20 %",
    "shuffled": "rows at random: leaks, and is stamped so",
}


class Section(NamedTuple):
    """Lines of two columns, or a table with a head."""

    title: str
    lines: Sequence[Sequence[str]]
    head: Sequence[str] = ()


def page_of(descriptor: Any) -> tuple[str, list[Section]]:
    """Return the title and the sections of a descriptor of any kind but a sensor."""
    if isinstance(descriptor, TaskDescriptor):
        task = descriptor.spec
        return f"Task {task.name}: {task.title}", _task(task)
    kind = type(descriptor).__name__.removesuffix("Descriptor")
    sections = [
        Section("", [*_facts(descriptor), *([("code", descriptor.where)] if hasattr(descriptor, "where") else [])])
    ]
    if isinstance(descriptor, IndenterDescriptor | ProfileDescriptor):
        numbers = _numbers(descriptor)
        lines = [(name, f"{one.default:g}", one.unit, one.range, one.text) for name, one in numbers.items()]
        if lines:
            sections.append(Section("Given by", lines, ("name", "default", "unit", "may be", "what it is")))
    return f"{kind} {descriptor.name}: {descriptor.title}", sections


def _task(task: TaskSpec) -> list[Section]:
    """Return what a task asks, of which recordings, under which rules, and what others have published."""
    direction = "lower" if task.metric in LOWER_IS_BETTER else "higher"
    optional = f"; where a sensor has them {', '.join(task.optional_features)}" if task.optional_features else ""
    facts = [
        ("question", task.question),
        ("target", _target(task)),
        *([("one answer", f"a {task.answer_per}, from {task.answer_from}")] if task.answer_per != "sample" else []),
        ("looks at", f"channels of kind {', '.join(task.features)}{optional}"),
        ("metric", f"{METRIC_NAMES.get(task.metric, task.metric)}{suffix(task.unit)}, {direction} is better"),
        ("the same in practice", "nobody has said" if task.equivalence is None
                                 else f"a difference of up to {task.equivalence:g}{suffix(task.unit)}"),
        ("estimators", f"{', '.join(task.estimators)} when none is asked for"),
        ("baselines", f"{', '.join(task.baselines)}: trivial answers, in every table"),
    ]  # fmt: skip
    recordings = Section("Recordings", [("", "made elsewhere: run it with --rig replay --recordings DIR")])
    if task.scenes:
        head = ("role", "scenes", "indenter", "placement", "force", "duration")
        recordings = Section("Recordings", _scenes(task), head)
    protocols = [(name, _protocol(name)) for name in task.protocols]
    splits = [(name, _split(task, name)) for name in task.splits]
    published = [_published(one, task.unit) for one in task.published]
    others = (
        ("Protocols, the default first", protocols),
        ("Splits, the default first", splits),
        ("Published", published),
    )
    return [Section("", facts), recordings, *(Section(title, lines) for title, lines in others if lines)]


MOST_PLACES = 8
"""That are named one by one."""


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


def _published(one: Published, unit: str) -> tuple[str, str]:
    whose = "/".join(filter(None, (one.sensor or "any sensor", one.estimator or "their own model")))
    remark = f" ({one.remark})" if one.remark else ""
    return f"{one.score:g}{suffix(unit)}", f"{whose}, {one.protocol}: {one.reference}{remark}"


def _facts(descriptor: Any) -> Iterator[tuple[str, str]]:
    """Yield what there is to know beside name, title and code."""
    if isinstance(descriptor, EstimatorDescriptor):
        answers = {"features": "the features", "time": "the time index alone", "nothing": "nothing",
                   "reference": "the reference sensor: an oracle"}  # fmt: skip
        grid = [f"{name}: {', '.join(f'{one:g}' for one in values)}" for name, values in descriptor.grid.items()]
        if descriptor.window_grid != (0,):
            grid.append(f"window: {', '.join(map(str, descriptor.window_grid))} samples before the newest")
        linear = {True: "linear", False: "not linear", None: "not said"}[descriptor.linear]
        yield "answers", " and ".join(descriptor.kinds)
        yield "looks at", answers[descriptor.looks_at]
        yield "model", linear + (", a trivial answer" if descriptor.baseline else "")
        yield "may be set", ", ".join(f"{name}={value}" for name, value in descriptor.params.items()) or "nothing"
        yield "chosen on validation data", "; ".join(grid) or "nothing"
    elif isinstance(descriptor, RigDescriptor):
        offered = ("verification", "work_precision")
        able = [name.replace("_", " ") for name in offered if getattr(descriptor, name)]
        yield (
            "scenes are",
            "simulated; rows are marked SIM" if descriptor.simulated else "carried out on hardware, or were",
        )
        yield "solvers", ", ".join(descriptor.rungs) or "none"
        yield "also offers", ", ".join(able) or "nothing"
    elif isinstance(descriptor, EffectDescriptor):
        for name in ("produces", "consumes", "groups"):
            yield name, ", ".join(getattr(descriptor, name)) or "none"
    elif isinstance(descriptor, DeviceDescriptor):
        yield from (
            ("used for", descriptor.kind),
            ("driver", descriptor.driver),
            ("emulator", descriptor.emulator or "none"),
        )
    else:
        asked = ",".join(f"{name}={one.default:g}" for name, one in _numbers(descriptor).items())
        option = "--indenter" if isinstance(descriptor, IndenterDescriptor) else "--profile"
        yield "asked for", f"tactbench record {option} {descriptor.name}{f':{asked}' if asked else ''}"


def _numbers(descriptor: IndenterDescriptor | ProfileDescriptor) -> Mapping[str, Parameter]:
    return descriptor.dimensions if isinstance(descriptor, IndenterDescriptor) else descriptor.parameters
