"""The options that say how a simulated rig carries out its scenes, and with which nuisances."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import FiniteRange

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.scene import Simulation
    from tactbench.core.spec.sensor import SensorSpec


SIMULATION = (
    click.option("--scenario", metavar="NAME",
                 help="A way of handling the sensor that its spec states by name; see `tactbench list scenarios`."),
    click.option("--effects", metavar="LIST",
                 help="Effects to include or leave out whatever the plan says: +creep,-drift. +all, -all. Without a "
                 "sign the plan decides: an effect of another package takes part only where it is named."),
    click.option("--rung", metavar="NAME", help="Rung of the ladder of contact solvers; see docs/twin.md."),
    click.option("--tolerance", type=FiniteRange(min=0, min_open=True), metavar="X",
                 help="Largest error of a simulated channel, in its unit: the cheapest rung that keeps it."),
    click.option("--set", "nuisances", multiple=True, metavar="NAME=X",
                 help="Another value of a nuisance, in the unit of its name: placement_scatter_mm=0.3; may be "
                 "repeated."),
)  # fmt: skip
"""Given to `simulation_of`."""


def simulation_of(
    registry: Registry,
    rig: str,
    sensors: Iterable[str],
    *,
    effects: str | None,
    rung: str | None,
    tolerance: float | None,
    scenario: str | None,
    nuisances: Sequence[str],
    stated: Simulation | None = None,
) -> Simulation | None:
    """Return what the options ask for, laid over what a file states; None when neither asks for anything.

    Raises
    ------
    UsageError
        If a word of --effects is not one, the rig has no such rung, no sensor states such a scenario, nobody declares
        such a nuisance, it cannot have its value, or the rig is not simulated at all.
    """
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.scene import Simulation

    change: dict[str, Any] = {}
    if effects is not None:
        change["effects"] = tuple(word.strip() for word in effects.split(",") if word.strip())
    if rung is not None or tolerance is not None:
        change |= {"rung": rung, "tolerance": tolerance}
    if scenario is not None:
        change["scenario"] = scenario
    if nuisances:
        change["nuisances"] = {**dict(stated.nuisances if stated else ()), **_values_of(nuisances)}
    if not change and (stated is None or not stated.nuisances):
        return stated
    descriptor = registry.rigs[rig]
    if not descriptor.simulated:
        raise UsageError(
            f"--effects, --rung, --tolerance, --scenario and --set are for simulated rigs; {rig} is not one.",
            hint="Leave them out.",
        )
    scenarios = [name for sensor in registry.sensors for name in sensor.spec.scenarios]
    if scenario is not None and scenario not in scenarios:
        raise UnknownNameError("scenario", scenario, scenarios)
    if rung is not None and rung not in descriptor.rungs:
        raise UnknownNameError(f"rung of {rig}", rung, descriptor.rungs)
    if rung is not None and tolerance is not None:
        raise UsageError(
            "--rung and --tolerance were both given.", hint="A tolerance picks the rung: give one of them."
        )
    known = {name for effect in registry.effects for name in (effect.name, *effect.groups)} | {"all"}
    for word in change.get("effects", ()):
        name = word.lstrip("+-")
        if name not in known:
            raise UnknownNameError("effect", name, sorted(known))
        if word == name and (name not in registry.effects or registry.effects.owned(name).ours):
            raise UsageError(f"--effects {word!r} lacks its sign.", hint=f"Write +{word} or -{word}.")
    simulation = Simulation.model_validate({**(stated or Simulation()).model_dump(), **change})
    _check_nuisances(simulation, [registry.sensors[name].spec for name in sensors])
    return simulation


def _values_of(given: Sequence[str]) -> dict[str, float]:
    """Return the values of ``name=number``; raises UsageError for what is none, or is given twice."""
    from tactbench.core.errors import UsageError

    values: dict[str, float] = {}
    for text in given:
        name, equals, number = text.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not equals or not math.isfinite(value):
            raise UsageError(
                f"--set {text!r} is not a name and a number.", hint="Write --set placement_scatter_mm=0.3."
            )
        if name in values:
            raise UsageError(f"--set gives {name} twice: {values[name]:g} and {value:g}.", hint="Give it once.")
        values[name] = value
    return values


def _check_nuisances(simulation: Simulation, sensors: Sequence[SensorSpec]) -> None:
    """Refuse what neither scenes nor any of `sensors` declare, and values that a sensor cannot have."""
    from tactbench.core.errors import UnknownNameError
    from tactbench.core.spec.scene import NUISANCES

    known = dict.fromkeys([*NUISANCES, *(name for sensor in sensors for name in sensor.settable())])
    for name, _ in simulation.nuisances:
        if name not in known:
            raise UnknownNameError("nuisance", name, known)
    for sensor in sensors:
        sensor.with_nuisances(dict(simulation.nuisances))
