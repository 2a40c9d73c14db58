"""Options of a simulated rig: effects, nuisances, scenario, solver (rung) and tolerance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from pydantic import FiniteFloat, TypeAdapter, ValidationError

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.scene import NUISANCES, Simulation

_NAMED = ("rung", "scenario")


def simulation_of(
    registry: Registry, rig: str, sensors: Sequence[str], effects: str | None, settings: Iterable[str] = (),
    stated: Simulation = Simulation(),  # noqa: B008  (it never changes)
) -> Simulation:  # fmt: skip
    """Return the settings of a simulated rig: those `stated` in the matrix file, changed by --effects and --set.

    Raises
    ------
    UsageError
        If --effects or --set contains an unknown name, --set a value out of its range, or the rig is not
        simulated.
    """
    given = dict(map(_setting, settings))
    change: dict[str, Any] = {name: given.pop(name) for name in (*_NAMED, "tolerance") if name in given}
    if effects is not None:
        change["effects"] = tuple(word.strip() for word in effects.split(",") if word.strip())
    if not (change or given or stated.nuisances):
        return stated
    if not registry.rigs[rig].simulated:
        raise UsageError(f"--effects and --set are for simulated rigs; {rig} is none.", hint="Leave out both options.")
    scenarios = [name for sensor in registry.sensors for name in sensor.spec.scenarios]
    for key, what, known in (("scenario", "scenario", scenarios), ("rung", f"rung of {rig}", registry.rigs[rig].rungs)):
        if key in change and change[key] not in known:
            raise UnknownNameError(what, change[key], known)
    for word in change.get("effects", ()):
        _check_effect(registry, word)
    if "rung" in change or "tolerance" in change:  # one takes the other's place
        change = {"rung": None, "tolerance": None, **change}
    change["nuisances"] = {**dict(stated.nuisances), **given}
    try:
        simulation = Simulation.model_validate({**stated.model_dump(), **change})
    except ValidationError as error:
        raise UsageError(f"--set: {error.errors()[0]['msg']}.", hint="See `tactbench run --help`.") from error
    specs = [registry.sensors[name].spec for name in sensors]
    nuisances = dict.fromkeys([*NUISANCES, *(name for sensor in specs for name in sensor.settable())])
    for name, _ in simulation.nuisances:
        if name not in nuisances:
            raise UnknownNameError("nuisance", name, nuisances)
    for sensor in specs:
        sensor.with_nuisances(dict(simulation.nuisances))
    return simulation


def _setting(text: str) -> tuple[str, Any]:
    """Return the name and value of a --set option; raises UsageError if a number is expected and not given."""
    name, _, value = text.partition("=")
    if name in _NAMED and value:
        return name, value
    try:
        return name, TypeAdapter(FiniteFloat).validate_python(value)
    except ValueError as error:
        raise UsageError(
            f"--set {text!r} is not NAME=NUMBER.", hint="Write, for example, --set placement_scatter_mm=0.3."
        ) from error


def _check_effect(registry: Registry, word: str) -> None:
    """Raise UsageError if a word of --effects is not the name of an effect, or lacks its sign + or -."""
    name = word.lstrip("+-")
    effects = {name for effect in registry.effects for name in (effect.name, *effect.groups)} | {"all"}
    if name not in effects:
        raise UnknownNameError("effect", name, effects)
    if word == name and (name not in registry.effects or registry.effects.owned(name).ours):
        raise UsageError(f"--effects {word!r} lacks its sign + or -.", hint=f"Write +{word} or -{word}.")
