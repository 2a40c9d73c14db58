"""Which effects a scene gets, in which order, and why: the closure over what somebody will look at.

Effects name tokens they produce and consume. What is observed is needed; whoever produces something needed is
needed, and then everything it consumes. An effect is included when it is needed and its own predicate says that the
scene calls for it. Nothing else is imported, allocated or stepped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tactbench.plugin import (
    ChannelKind,
    EffectDescriptor,
    NotApplicable,
    PlanEntry,
    PluginContractError,
    Reason,
    Scene,
    SensorSpec,
    load_object,
)

STORED = "stored"
"""Token of what a recording always needs: stored samples."""
REFERENCE = "reference-force"
"""Token of the other thing it always needs: the reference force."""
LENT = "core"
"""Token of effects that the contact solver calls upon by itself, if a load needs them."""
NOBODY = "no observed channel depends on it"


@dataclass(frozen=True)
class Plan:
    """The effects of one scene."""

    kinds: tuple[ChannelKind, ...]
    """Kinds of channels that will be recorded."""
    entries: tuple[PlanEntry, ...]
    """Included effects in their order, then those left out."""
    stages: tuple[EffectDescriptor, ...]
    """What is applied, in order."""
    lent: Mapping[str, str]
    """What the solver may call upon: name -> ``module:callable``."""

    def settled(self, decided: Mapping[str, tuple[bool, str]]) -> tuple[PlanEntry, ...]:
        """Return the entries with those that only the solve could decide replaced."""
        entries = [
            PlanEntry(effect=entry.effect, included=decided[entry.effect][0], reason=decided[entry.effect][1])
            if entry.effect in decided
            else entry
            for entry in self.entries
        ]
        return tuple(sorted(entries, key=lambda entry: not entry.included))


def plan_scene(effects: Sequence[EffectDescriptor], scene: Scene, sensor: SensorSpec) -> Plan:
    """Plan one scene with one sensor.

    Raises
    ------
    NotApplicable
        If nothing observed is among the sensor's channels, or no included effect gives an observed kind.
    """
    kinds = _observed(scene, sensor)
    needed = _closure(effects, {*kinds, STORED, REFERENCE})
    included: list[EffectDescriptor] = []
    reasons: dict[str, str] = {}
    for effect in effects:
        if not needed.intersection(effect.produces):
            reasons[effect.name] = NOBODY
            continue
        reason = load_object(effect.called_for)(scene, sensor)
        if not isinstance(reason, Reason):
            raise PluginContractError(
                f"{effect.called_for} of effect {effect.name} returned {type(reason).__name__}, not Reason.",
                hint="Return tactbench.plugin.Reason(called_for, text).",
            )
        reasons[effect.name] = reason.text
        if reason.called_for:
            included.append(effect)
    for kind in kinds:
        if not any(kind in effect.produces for effect in included):
            raise NotApplicable(
                f"The twin does not model {kind} of {sensor.name}: no installed effect produces it in this scene.",
                hint="Record it on hardware or replay it, or install a plugin with such an effect.",
            )
    ordered = _ordered(included)
    left_out = [effect for effect in effects if effect not in included]
    return Plan(
        kinds=kinds,
        entries=tuple(
            PlanEntry(effect=effect.name, included=effect in included, reason=reasons[effect.name])
            for effect in (*ordered, *left_out)
        ),
        stages=tuple(effect for effect in ordered if LENT not in effect.produces),
        lent={effect.name: effect.where for effect in ordered if LENT in effect.produces},
    )


def _observed(scene: Scene, sensor: SensorSpec) -> tuple[ChannelKind, ...]:
    present = {channel.kind for channel in sensor.channels()}
    kinds = tuple(dict.fromkeys(kind for kind in scene.observe if kind in present))
    if not kinds:
        raise NotApplicable(
            f"needs a channel of kind {' or '.join(scene.observe) or '(none named)'}; {sensor.name} has "
            f"{', '.join(sorted(present))}."
        )
    return kinds


def _closure(effects: Sequence[EffectDescriptor], wanted: set[str]) -> set[str]:
    needed = set(wanted)
    while True:
        more = {
            token for effect in effects if needed.intersection(effect.produces) for token in effect.consumes
        } - needed
        if not more:
            return needed
        needed |= more


def _ordered(effects: Sequence[EffectDescriptor]) -> list[EffectDescriptor]:
    """Return producers before consumers, otherwise in the order given."""
    waiting, done = list(effects), []
    while waiting:
        for effect in waiting:
            others = [other for other in waiting if other is not effect]
            if not any(set(effect.consumes).intersection(other.produces) for other in others):
                break
        else:
            names = ", ".join(effect.name for effect in waiting)
            raise PluginContractError(
                f"The effects {names} consume each other's results in a circle.",
                hint="Correct produces and consumes in their descriptors.",
            )
        waiting.remove(effect)
        done.append(effect)
    return done
