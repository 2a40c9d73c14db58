"""The options that say how a simulated rig carries out its scenes, and with which nuisances."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.rig import RigDescriptor
    from tactbench.core.spec.scene import Simulation

EFFECTS = click.option(
    "--effects", metavar="LIST",
    help="Force effects in or out: +creep,-drift; groups and +all, -all too. A plain name enables an effect of another "
    "package.",
)  # fmt: skip
SIMULATION = (
    EFFECTS,
    click.option(
        "--set", "settings", multiple=True, metavar="NAME=VALUE",
        help="Set a nuisance (placement_scatter_mm=0.3), or rung, tolerance or scenario of the simulation; repeatable.",
    ),
)  # fmt: skip
"""Given to `simulation_of`."""

_NAMED = ("rung", "scenario")


def simulation_of(
    registry: Registry,
    rig: str,
    sensors: Iterable[str],
    *,
    effects: str | None,
    settings: Sequence[str] = (),
    stated: Simulation | None = None,
) -> Simulation | None:
    """Return what the options ask for, laid over what a file states; None when neither asks for anything.

    Raises
    ------
    UsageError
        If a word of --effects is not one, nobody declares what --set names, it cannot have its value, or the rig is not
        simulated at all.
    """
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.scene import NUISANCES, Simulation

    change = _settings(settings)
    if effects is not None:
        change["effects"] = tuple(word.strip() for word in effects.split(",") if word.strip())
    if not change and (stated is None or not stated.nuisances):
        return stated
    descriptor = registry.rigs[rig]
    if not descriptor.simulated:
        raise UsageError(f"--effects and --set are for simulated rigs; {rig} is not one.", hint="Leave them out.")
    _check(registry, descriptor, change)
    if "rung" in change or "tolerance" in change:  # one takes the other's place
        change = {"rung": None, "tolerance": None, **change}
    given = change.pop("nuisances", {})
    before = stated or Simulation()
    simulation = Simulation.model_validate(
        {**before.model_dump(), **change, "nuisances": {**dict(before.nuisances), **given}}
    )
    specs = [registry.sensors[name].spec for name in sensors]
    known = dict.fromkeys([*NUISANCES, *(name for sensor in specs for name in sensor.settable())])
    for name, _ in simulation.nuisances:
        if name not in known:
            raise UnknownNameError("nuisance", name, [*known, *(_NAMED if name in given else ())])
    for sensor in specs:
        sensor.with_nuisances(dict(simulation.nuisances))
    return simulation


def _settings(given: Sequence[str]) -> dict[str, Any]:
    """Return what --set changes; raises UsageError for what is no pair, or is given twice."""
    from tactbench.core.errors import UsageError

    named: dict[str, Any] = {}
    numbers: dict[str, float] = {}
    for text in given:
        name, _, value = text.partition("=")
        if name in named or name in numbers:
            raise UsageError(f"--set gives {name} twice.", hint="Give it once.")
        if name in _NAMED and value:
            named[name] = value
            continue
        try:
            numbers[name] = float(value)
        except ValueError:
            numbers[name] = math.nan
        if not math.isfinite(numbers[name]):
            raise UsageError(
                f"--set {text!r} is not a name and a number.", hint="Write --set placement_scatter_mm=0.3."
            )
    if "tolerance" in numbers:
        named["tolerance"] = numbers.pop("tolerance")
        if named["tolerance"] <= 0 or "rung" in named:
            raise UsageError(
                "--set tolerance is above 0, and picks the rung.", hint="Leave out --set rung, or the tolerance."
            )
    return {**named, "nuisances": numbers} if numbers else named


def _check(registry: Registry, rig: RigDescriptor, change: dict[str, Any]) -> None:
    """Refuse names of rungs, scenarios and effects that nobody declares."""
    from tactbench.core.errors import UnknownNameError, UsageError

    scenarios = [name for sensor in registry.sensors for name in sensor.spec.scenarios]
    for key, what, known in (("scenario", "scenario", scenarios), ("rung", f"rung of {rig.name}", rig.rungs)):
        if key in change and change[key] not in known:
            raise UnknownNameError(what, change[key], known)
    effects = {name for effect in registry.effects for name in (effect.name, *effect.groups)} | {"all"}
    for word in change.get("effects", ()):
        name = word.lstrip("+-")
        if name not in effects:
            raise UnknownNameError("effect", name, sorted(effects))
        if word == name and (name not in registry.effects or registry.effects.owned(name).ours):
            raise UsageError(f"--effects {word!r} lacks its sign.", hint=f"Write +{word} or -{word}.")
