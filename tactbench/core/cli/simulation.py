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
    from pydantic import ValidationError

    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.scene import NUISANCES, Simulation

    given = dict(map(_setting, settings))
    change: dict[str, Any] = {name: given.pop(name) for name in (*_NAMED, "tolerance") if name in given}
    if effects is not None:
        change["effects"] = tuple(word.strip() for word in effects.split(",") if word.strip())
    if not change and not given and (stated is None or not stated.nuisances):
        return stated
    descriptor = registry.rigs[rig]
    if not descriptor.simulated:
        raise UsageError(f"--effects and --set are for simulated rigs; {rig} is not one.", hint="Leave them out.")
    _check(registry, descriptor, change)
    before = stated or Simulation()
    if "rung" in change or "tolerance" in change:  # one takes the other's place
        change = {"rung": None, "tolerance": None, **change}
    change["nuisances"] = {**dict(before.nuisances), **given}
    try:
        simulation = Simulation.model_validate({**before.model_dump(), **change})
    except ValidationError as error:
        raise UsageError(f"--set: {error.errors()[0]['msg']}.", hint="See `tactbench run --help`.") from error
    specs = [registry.sensors[name].spec for name in sensors]
    known = dict.fromkeys([*NUISANCES, *(name for sensor in specs for name in sensor.settable())])
    for name, _ in simulation.nuisances:
        if name not in known:
            raise UnknownNameError("nuisance", name, known)
    for sensor in specs:
        sensor.with_nuisances(dict(simulation.nuisances))
    return simulation


def _setting(text: str) -> tuple[str, Any]:
    """Return a name and a value of --set; raises UsageError for a value that is no number where one is expected."""
    from tactbench.core.errors import UsageError

    name, _, value = text.partition("=")
    if name in _NAMED and value:
        return name, value
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise UsageError(f"--set {text!r} is not a name and a number.", hint="Write --set placement_scatter_mm=0.3.")
    return name, number


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
