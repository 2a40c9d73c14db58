"""Selection and order of the effects that simulate a scene, with a reason for each.

Effects name the tokens (results) that they produce and consume. Tokens observed by the scene are needed. An effect that
produces a needed token is included if its own decision function or the scene includes it; then the tokens that it
consumes are needed, too. No other effect is imported or applied.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tactbench.plugin import (
    ChannelKind,
    NotApplicable,
    PlanEntry,
    PluginContractError,
    Scene,
    SensorSpec,
    UsageError,
    load_object,
)
from tactbench.plugin.simulation import EffectDescriptor, Reason
from tactbench.rigs.twin.effects.called_for import NOT_OBSERVED
from tactbench.rigs.twin.synthesis import Settled

STORED = "stored"
"""Name of the result "stored samples", which every recording needs."""
REFERENCE = "reference-force"
"""Name of the result "reference force", which every recording needs."""
LENT = ("core", "fluid-pressure", "shear")
"""Names of the effects that the contact solver itself applies, or applies when a load needs them."""


@dataclass(frozen=True)
class Plan:
    """Effects that simulate one scene, in order, with the reasons for and against each."""

    kinds: tuple[ChannelKind, ...]
    """Kinds of channels that will be recorded."""
    entries: tuple[PlanEntry, ...]
    """Included effects in the order of application, followed by the effects left out."""
    stages: tuple[EffectDescriptor, ...]
    """Descriptors of the effects to apply, in order."""
    lent: frozenset[str]
    """Names of the included effects that the contact solver applies."""

    def settled(self, decided: Mapping[str, Settled]) -> tuple[PlanEntry, ...]:
        """Return the entries, after replacing those that could be decided only after the contact was solved."""
        entries = [
            entry.model_copy(update=decided[entry.effect]._asdict()) if entry.effect in decided else entry
            for entry in self.entries
        ]
        return tuple(sorted(entries, key=lambda entry: not entry.included))


def plan_scene(effects: Sequence[EffectDescriptor], scene: Scene, sensor: SensorSpec) -> Plan:
    """Return the plan of one scene with one sensor.

    Raises
    ------
    NotApplicable
        If the sensor has no channel of the observed kinds, or no included effect computes an observed kind.
    """
    kinds = _observed(scene, sensor)
    signed = _signed(effects, scene)
    reasons = _needed(effects, {*kinds, STORED, REFERENCE}, signed, scene, sensor)
    included: list[EffectDescriptor] = []
    entries: dict[str, PlanEntry] = {}
    for effect in effects:
        reason = reasons[effect.name]
        taken = signed.get(effect.name, reason.called_for)
        if taken:
            included.append(effect)
        asked, text, change = effect.name in signed, reason.text, reason.change
        if asked and (taken or reason.called_for):
            text = f"{'included' if taken else 'left out'} as stated; else: {text}"
        if reason.called_for and not taken:
            change = None  # what an effect would have changed that was called for is no bound any more
        entries[effect.name] = PlanEntry(
            effect=effect.name, included=taken, reason=text, change=change, unit=reason.unit, asked=asked
        )
    for kind in kinds:
        if not any(kind in effect.produces for effect in included):
            without = [name for name, taken in signed.items() if not taken]
            raise NotApplicable(
                f"The twin does not model {kind} of {sensor.name}: no installed effect produces it in this scene"
                + (f" without {', '.join(without)}." if without else "."),
                hint="Record or replay a real sensor, or install a plugin with an effect for this kind.",
            )
    ordered = _ordered(included)
    left_out = [effect for effect in effects if effect not in included]
    return Plan(
        kinds=kinds,
        entries=tuple(entries[effect.name] for effect in (*ordered, *left_out)),
        stages=tuple(effect for effect in ordered if effect.name not in LENT),
        lent=frozenset(effect.name for effect in ordered).intersection(LENT),
    )


def _signed(effects: Sequence[EffectDescriptor], scene: Scene) -> dict[str, bool]:
    """Return the effects that the scene includes (True) or leaves out (False) by name; later words override earlier.

    Raises
    ------
    UsageError
        If a word is neither an effect, nor a group of effects, nor ``all``.
    """
    signed: dict[str, bool] = {}
    for word in scene.simulation.effects:
        name = word.lstrip("+-")
        meant = [effect.name for effect in effects if name in (effect.name, *effect.groups, "all")]
        if not meant:
            groups = sorted({group for effect in effects for group in effect.groups} | {"all"})
            raise UsageError(
                f"The word {word!r} of the scene's effects names {name!r}, which is not an installed effect.",
                hint=f"Effects: {', '.join(effect.name for effect in effects)}. Groups: {', '.join(groups)}.",
            )
        for found in meant:
            signed.pop(found, None)
            if word != name:
                signed[found] = word.startswith("+")
    return signed


def _observed(scene: Scene, sensor: SensorSpec) -> tuple[ChannelKind, ...]:
    present = {channel.kind for channel in sensor.channels()}
    kinds = tuple(dict.fromkeys(kind for kind in scene.observe if kind in present))
    if not kinds:
        raise NotApplicable(
            f"The scene needs a channel of kind {' or '.join(scene.observe) or '(none is named)'}; {sensor.name} has "
            f"{', '.join(sorted(present))}."
        )
    return kinds


def _needed(
    effects: Sequence[EffectDescriptor], tokens: set[str], signed: Mapping[str, bool], scene: Scene, sensor: SensorSpec
) -> dict[str, Reason]:
    """Return the reasons to include or leave out each effect, by the effect's name.

    Only an included effect makes the tokens that it consumes needed.
    """
    reasons: dict[str, Reason] = {}
    for effect in effects:
        reasons[effect.name] = reason = load_object(effect.called_for)(scene, sensor)
        if not isinstance(reason, Reason):
            raise PluginContractError(
                f"{effect.called_for} of effect {effect.name} returned {type(reason).__name__}, not Reason.",
                hint="Return tactbench.plugin.Reason(called_for, text).",
            )
    taking = [effect for effect in effects if signed.get(effect.name, reasons[effect.name].called_for)]
    needed = tokens.union(*(effect.produces for effect in effects if signed.get(effect.name)))
    before: set[str] = set()
    while needed != before:
        before = needed
        needed = needed.union(*(effect.consumes for effect in taking if needed.intersection(effect.produces)))
    for effect in taking:
        if not needed.intersection(effect.produces):
            reasons[effect.name] = Reason(False, NOT_OBSERVED, 0.0)
    return reasons


def _ordered(effects: Sequence[EffectDescriptor]) -> list[EffectDescriptor]:
    """Return effects sorted such that a producer precedes its consumers, otherwise in the order given."""
    waiting, done = list(effects), []
    while waiting:
        for effect in waiting:
            others = [other for other in waiting if other is not effect]
            if not any(set(effect.consumes).intersection(other.produces) for other in others):
                break
        else:
            names = ", ".join(effect.name for effect in waiting)
            raise PluginContractError(
                f"The effects {names} consume each other's results in a circle, so that none can be first.",
                hint="Correct `produces` and `consumes` in their descriptors.",
            )
        waiting.remove(effect)
        done.append(effect)
    return done
