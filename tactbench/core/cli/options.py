"""Command-line options that several verbs share."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Command = Callable[..., Any]


class FiniteRange(click.FloatRange):
    """Option type for a range of finite numbers; `click.FloatRange` alone would accept NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return `value` as a number; raise a usage error if it is not finite or out of range."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


DEFAULT_FOLDER = Path("tactbench-results")
ABOVE_0 = FiniteRange(min=0, min_open=True)


def options(*several: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Return a decorator that adds options to a verb, listed in the given order in its help."""

    def add(command: Command) -> Command:
        for option in reversed(several):
            command = option(command)
        return command

    return add


def format_option(*shapes: str) -> Callable[[Command], Command]:
    """Return the option ``--format`` with the choices `shapes`, the first of which is the default."""
    return click.option("--format", "shape", type=click.Choice(shapes), default=shapes[0],
                        help="Output format.")  # fmt: skip


YES = click.option("--yes", is_flag=True, help="Do not prompt.")
RESULTS = click.option("--out", type=click.Path(path_type=Path), default=DEFAULT_FOLDER,
                       metavar="DIR", help="Result folder.")  # fmt: skip
JOBS = click.option("--jobs", type=click.IntRange(min=1), metavar="N",
                    help="Parallel worker processes. Default: one per usable core.")  # fmt: skip

EFFECTS = click.option(
    "--effects", metavar="LIST",
    help="Force effects in or out: +creep,-drift; groups and +all, -all too. With a plain name an "
    "effect of another package takes part where a scene calls for it.",
)  # fmt: skip
SIMULATION = options(
    EFFECTS,
    click.option(
        "--set", "settings", multiple=True, metavar="NAME=VALUE",
        help="Set a nuisance (placement_scatter_mm=0.3), or rung, tolerance or scenario of the simulation; repeatable.",
    ),
)  # fmt: skip
"""Options --effects and --set, for `tactbench.core.study.simulation.simulation_of`."""
