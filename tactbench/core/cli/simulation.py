"""The options that say how a simulated rig carries out its scenes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.scene import Simulation


def simulation_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --effects, --rung, --tolerance and --scenario to a verb; what they mean is given to `simulation_of`."""
    for option in (
        click.option("--tolerance", type=click.FloatRange(min=0, min_open=True), metavar="X",
                     help="Largest error of a simulated channel, in its unit: the cheapest rung that keeps it."),
        click.option("--rung", metavar="NAME", help="Rung of the ladder of contact solvers; see docs/twin.md."),
        click.option("--effects", metavar="LIST",
                     help="Effects to include or leave out whatever the plan says: +creep,-drift. +all, -all."),
        click.option("--scenario", metavar="NAME",
                     help="A way of handling the sensor that its spec states by name; see `tactbench list scenarios`."),
    ):  # fmt: skip
        command = option(command)
    return command


def simulation_of(
    registry: Registry,
    rig: str,
    *,
    effects: str | None,
    rung: str | None,
    tolerance: float | None,
    scenario: str | None,
) -> Simulation | None:
    """Return what the options ask for; None when they ask for nothing.

    Raises
    ------
    UsageError
        If a word of --effects is not one, the rig has no such rung, no sensor states such a scenario, or the rig is
        not simulated at all.
    """
    from tactbench.core.errors import UnknownNameError, UsageError
    from tactbench.core.spec.scene import Simulation

    if effects is None and rung is None and tolerance is None and scenario is None:
        return None
    descriptor = registry.rigs[rig]
    if not descriptor.simulated:
        raise UsageError(
            f"--effects, --rung, --tolerance and --scenario are for simulated rigs; {rig} is not one.",
            hint="Leave them out.",
        )
    stated = [name for sensor in registry.sensors for name in sensor.spec.scenarios]
    if scenario is not None and scenario not in stated:
        raise UnknownNameError("scenario", scenario, stated)
    if rung is not None and rung not in descriptor.rungs:
        raise UnknownNameError(f"rung of {rig}", rung, descriptor.rungs)
    if rung is not None and tolerance is not None:
        raise UsageError(
            "--rung and --tolerance were both given.", hint="A tolerance picks the rung: give one of them."
        )
    words = tuple(word.strip() for word in (effects or "").split(",") if word.strip())
    known = {name for effect in registry.effects for name in (effect.name, *effect.groups)} | {"all"}
    for word in words:
        if word[0] not in "+-":
            raise UsageError(f"--effects {word!r} lacks its sign.", hint=f"Write +{word} or -{word}.")
        if word[1:] not in known:
            raise UnknownNameError("effect", word[1:], sorted(known))
    return Simulation(effects=words, rung=rung, tolerance=tolerance, scenario=scenario)
