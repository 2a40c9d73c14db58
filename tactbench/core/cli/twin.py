"""``tactbench twin``: what the simulated rig would do and why, and whether it is right."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from tactbench.core.cli.options import options
from tactbench.core.cli.simulation import SIMULATION
from tactbench.core.cli.threads import keep_threads

if TYPE_CHECKING:
    from tactbench.core.plugins.registry import Registry

FORMATS = ("table", "json", "csv")


@click.group(name="twin")
def command() -> None:
    """Look into the simulated rig: its plans, its errors, its likeness to real sensors."""


@command.command(name="explain")
@click.option("--sensor", required=True, metavar="NAME", help="What is pressed on.")
@click.option("--task", required=True, metavar="NAME", help="Whose scenes are planned.")
@click.option("--scene", "scene_name", metavar="NAME", help="One scene of the task; default: one of each kind of plan.")
@click.option("--rig", metavar="NAME", help="Which simulated rig; default: the first.")
@click.option("--rounds", type=click.IntRange(min=0), default=5, show_default=True, metavar="N",
              help="Recordings made to measure what each effect costs; 0: only the plan.")  # fmt: skip
@click.option("--score/--no-score", default=None,
              help="Also record the task with the effects chosen and with all, and score both: tens of seconds. "
                   "Default: if it takes less than a minute, without --scene and --rounds 0.")  # fmt: skip
@click.option("--estimator", metavar="NAME", help="What answers for that score; default: a quick, linear one.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, metavar="N",
              help="Of the recordings that are scored.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(FORMATS), default="table", show_default=True)
@options(*SIMULATION)
def explain(
    sensor: str,
    task: str,
    scene_name: str | None,
    rig: str | None,
    rounds: int,
    score: bool | None,
    estimator: str | None,
    seed: int,
    shape: str,
    effects: str | None,
    rung: str | None,
    tolerance: float | None,
    scenario: str | None,
    nuisances: tuple[str, ...],
) -> None:
    """Say which effects a task's scenes get, which they do not, why, and what each costs or would cost.

    It ends with the task's score with the effects chosen beside that with all of them, and what leaving out saved.
    """
    keep_threads()
    from tactbench.core.cli.explanations import print_explanations
    from tactbench.core.cli.simulation import simulation_of
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    name = simulated_rig(registry, rig)
    simulation = simulation_of(
        registry, name, [sensor], effects=effects, rung=rung, tolerance=tolerance, scenario=scenario,
        nuisances=nuisances,
    )  # fmt: skip
    if score is None and (scene_name is not None or not rounds):
        score = False
    print_explanations(
        registry, name, sensor, task, scene_name, simulation, rounds, shape,
        scoring=score, estimator=estimator, seed=seed,
    )  # fmt: skip


@command.command(name="verify")
@click.option("--real", is_flag=True, help="Against figures measured on real sensors, instead of the oracles.")
@click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="With --real: which sensor; may be repeated.")
@click.option("--recordings", metavar="DIR", help="With --real: hold these recordings against the ranges instead.")
@click.option("--only", "only", multiple=True, metavar="NAME", help="A check or group of checks; may be repeated.")
@click.option("--rig", metavar="NAME", help="Which simulated rig; default: the first.")
@click.option("--format", "shape", type=click.Choice(FORMATS), default="table", show_default=True)
@click.pass_context
def verify(
    ctx: click.Context,
    real: bool,
    sensors: tuple[str, ...],
    recordings: str | None,
    only: tuple[str, ...],
    rig: str | None,
    shape: str,
) -> None:
    """Hold the simulation against its oracles, or (--real) against what real sensors did.

    Exit code 1 if an oracle fails. A miss against real sensors is printed with its cause and is no failure.
    """
    keep_threads()
    from pathlib import Path

    from tactbench.core.cli.verdicts import carry_out, likeness_checks, oracle_checks, print_verdicts
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    name = simulated_rig(registry, rig)
    if (recordings or sensors) and not real:
        raise UsageError("--sensor and --recordings belong to --real.", hint="Add --real, or leave them out.")
    folder = Path(recordings) if recordings else None
    checks = likeness_checks(registry, name, sensors, folder) if real else oracle_checks(registry, name)
    found = carry_out(checks, only)
    print_verdicts(found, shape, real=real)
    ctx.exit(0 if real or all(verdict.met for _, verdict, _ in found) else 1)


def simulated_rig(registry: Registry, name: str | None) -> str:
    """Return the name of the simulated rig asked for, or of the first there is.

    Raises
    ------
    UsageError
        If the rig is not simulated, or there is none.
    """
    from tactbench.core.errors import UsageError

    simulated = [rig.name for rig in registry.rigs if rig.simulated]
    if name is not None and not registry.rigs[name].simulated:
        raise UsageError(f"The rig {name!r} is not simulated.", hint=f"Simulated: {', '.join(simulated) or 'none'}.")
    if name is None and not simulated:
        raise UsageError("No simulated rig is installed.", hint="See `tactbench plugins`.")
    return name or simulated[0]
