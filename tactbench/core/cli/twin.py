"""``tactbench twin``: what the simulated rig would do and why, and whether it is right."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import EFFECTS, format_option

if TYPE_CHECKING:
    from tactbench.core.plugins.interfaces import Verdict

_COLUMNS = ("", "what", "found", "expected", "bound", "unit", "source")


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
    from tactbench.core.cli.explanations import print_explanations
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.study.simulation import simulation_of

    registry = load_registry()
    rig = registry.first_rig("simulated")
    simulation = simulation_of(registry, rig, [sensor], effects)
    print_explanations(registry, rig, sensor, task, simulation, rounds, shape)


@command.command(name="verify")
@format_option("table", "json", "csv")
@click.pass_context
def verify(ctx: click.Context, shape: str) -> None:
    """Compare the simulation with laws and closed forms.

    Exit code 1 if it misses one.
    """
    from tactbench.core.cli.grid import print_grid, print_records
    from tactbench.core.errors import UsageError
    from tactbench.core.plugins.registry import load_object, load_registry
    from tactbench.core.tables.terminal import remark

    registry = load_registry()
    rig = registry.first_rig("simulated")
    where = registry.rigs[rig].verification
    if where is None:
        hint = "See `tactbench show` with its name."
        raise UsageError(f"The rig {rig!r} states no laws to be held against.", hint=hint)
    found: list[Verdict] = list(load_object(where)())
    if shape != "table":
        print_records([_record(verdict) for verdict in found], shape)
    else:
        kinds = ["" if verdict.met else "failed" for verdict in found]
        lines = [_line(verdict) for verdict in found]
        print_grid(rig, _COLUMNS, lines, numeric=("found", "expected", "bound"), kinds=kinds)
    met = sum(verdict.met for verdict in found)
    remark(f"{met} of {len(found)} within their bounds.")
    ctx.exit(0 if met == len(found) else 1)


def _line(verdict: Verdict) -> dict[str, str]:
    numbers = (f"{verdict.found:.5g}", f"{verdict.expected:.5g}", f"{verdict.bound:.2g}")
    unit = "" if verdict.unit == "1" else verdict.unit
    met = "ok" if verdict.met else "MISS"
    return dict(zip(_COLUMNS, (met, verdict.name, *numbers, unit, verdict.source), strict=True))


def _record(verdict: Verdict) -> dict[str, Any]:
    numbers = {name: getattr(verdict, name) for name in ("found", "expected", "bound")}
    finite = {name: number if math.isfinite(number) else None for name, number in numbers.items()}
    return {"what": verdict.name, "met": verdict.met, **finite, "unit": verdict.unit, "source": verdict.source}
