"""Which effects a scene gets, and why: the closure of what somebody looks at.

What nobody's channels need is not imported, not allocated and not stepped.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tactbench.plugin import ChannelSpec, EffectDescriptor, NotApplicable, PlanEntry, Scene, SensorSpec, load_object

STAGES = ("force", "load", "response", "readings", "samples")
"""The path of a reading. An effect works between two stages, or within one."""

Called = Callable[[Scene, SensorSpec], tuple[bool, str]]


@dataclass(frozen=True)
class Plan:
    """Effects in the order in which they are applied, and all decisions with their reasons."""

    effects: tuple[EffectDescriptor, ...]
    entries: tuple[PlanEntry, ...]
    channels: tuple[ChannelSpec, ...]


def plan(scene: Scene, sensor: SensorSpec, installed: Sequence[EffectDescriptor]) -> Plan:
    """Choose the effects of a scene.

    Parameters
    ----------
    scene, sensor
        What is pressed on what, and which kinds of channels somebody looks at.
    installed
        The effects there are.

    Raises
    ------
    NotApplicable
        If the sensor has no channel of a kind that is looked at.
    """
    for kind in scene.observe:
        if not sensor.channels(kind):
            raise NotApplicable(
                f"The scene looks at a {kind.replace('_', ' ')} channel; {sensor.name} has none.",
                hint="See what the sensor has with `tactbench show`.",
            )
    channels = sensor.channels(*scene.observe)
    wanted = {"label"} | ({"samples"} if channels else set())
    needed = _closure(wanted, installed)
    effects: list[EffectDescriptor] = []
    entries: list[PlanEntry] = []
    for effect in sorted(installed, key=_order):
        if effect.name not in needed:
            entries.append(PlanEntry(effect=effect.name, included=False, reason="no observed channel depends on it"))
            continue
        called: Called = load_object(effect.called_for)
        included, reason = called(scene, sensor)
        entries.append(PlanEntry(effect=effect.name, included=included, reason=reason))
        if included:
            effects.append(effect)
    entries += [
        PlanEntry(effect=f"channels of kind {kind}", included=False, reason="nobody looks at them in this scene")
        for kind in dict.fromkeys(channel.kind for channel in sensor.channels())
        if kind not in scene.observe
    ]
    return Plan(tuple(effects), tuple(entries), channels)


def _closure(wanted: set[str], installed: Sequence[EffectDescriptor]) -> set[str]:
    """Return the names of effects from which something in `wanted` follows."""
    names: set[str] = set()
    quantities = set(wanted)
    while True:
        more = {e.name for e in installed if set(e.produces) & quantities}
        if more <= names:
            return names
        names |= more
        quantities |= {q for e in installed if e.name in names for q in e.consumes}


def _order(effect: EffectDescriptor) -> tuple[int, int, str]:
    """Order by stage: what works within a stage comes before what leaves it."""
    ends = [STAGES.index(q) for q in effect.produces if q in STAGES]
    begins = [STAGES.index(q) for q in effect.consumes if q in STAGES]
    if not ends:
        return (len(STAGES), 0, effect.name)
    begin, end = max(begins, default=0), max(ends)
    return (begin, 1 if end > begin else 0, effect.name)
