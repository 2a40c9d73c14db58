"""``tactbench twin``: what the simulated rig would do and why, and whether it is right."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import format_option
from tactbench.core.cli.simulation import EFFECTS
from tactbench.core.cli.threads import keep_threads

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry


@click.group(name="twin")
def command() -> None:
    """Explain and verify the simulated rig."""


@command.command(name="explain")
@click.option("--sensor", required=True, metavar="NAME", help="Sensor.")
@click.option("--task", required=True, metavar="NAME", help="Task whose scenes are planned.")
@click.option("--rounds", type=click.IntRange(min=0), default=5, show_default=True, metavar="N",
              help="Recordings to time each effect with; 0: the plan alone, no times and score.")  # fmt: skip
@EFFECTS
@format_option("table", "json", "csv")
def explain(sensor: str, task: str, rounds: int, effects: str | None, shape: str) -> None:
    """Show which effects a task's scenes get, which they do not, why, and what each costs or would cost.

    It ends with the task's score with the effects chosen beside that with all of them.
    """
    keep_threads()
    from tactbench.core.cli.explanations import print_explanations
    from tactbench.core.cli.simulation import simulation_of
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    rig = simulated_rig(registry)
    simulation = simulation_of(registry, rig, [sensor], effects=effects)
    print_explanations(registry, rig, sensor, task, simulation, rounds, shape)


@command.command(name="verify")
@click.option("--real", is_flag=True, help="Compare with figures measured on real sensors instead of oracles.")
@click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR",
              help="With --real: check these recordings instead of simulated ones.")  # fmt: skip
@click.option("--only", multiple=True, metavar="NAME",
              help="Check, group of checks, or with --real a sensor; repeatable.")  # fmt: skip
@format_option("table", "json", "csv")
@click.pass_context
def verify(ctx: click.Context, real: bool, recordings: Path | None, only: tuple[str, ...], shape: str) -> None:
    """Compare the simulation with its oracles, or (--real) with real sensors.

    Exit code 1 if an oracle fails. A miss against real sensors is printed with its cause and is no failure.
    """
    keep_threads()
    from tactbench.core.cli.verdicts import carry_out, likeness_checks, oracle_checks, print_verdicts
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    rig = simulated_rig(registry)
    if recordings and not real:
        raise UsageError("--recordings belongs to --real.", hint="Add --real, or leave it out.")
    sensors = [name for name in only if real and name in registry.sensors]
    checks = likeness_checks(registry, rig, sensors, recordings) if real else oracle_checks(registry, rig)
    found = carry_out(checks, [name for name in only if name not in sensors])
    print_verdicts(found, shape, real=real)
    ctx.exit(0 if real or all(verdict.met for _, verdict, _ in found) else 1)


def simulated_rig(registry: Registry) -> str:
    """Return the name of the simulated rig: twin, or else the first there is; raises UsageError if there is none."""
    from tactbench.core.errors import UsageError

    simulated = [rig.name for rig in registry.rigs if rig.simulated]
    if not simulated:
        raise UsageError("No simulated rig is installed.", hint="See `tactbench list plugins`.")
    return "twin" if "twin" in simulated else simulated[0]
