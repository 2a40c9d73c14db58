"""Options that several verbs have."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Command = Callable[..., Any]


class FiniteRange(click.FloatRange):
    """A range of finite numbers: click alone accepts NaN in every range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; fails with a usage error."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is no finite number.", param, ctx)
        return number


DEFAULT_FOLDER = Path("tactbench-results")
ABOVE_0 = FiniteRange(min=0, min_open=True)


def options(*several: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Return a decorator that adds options to a verb, in this order in its help."""

    def add(command: Command) -> Command:
        for option in reversed(several):
            command = option(command)
        return command

    return add


def format_option(*shapes: str) -> Callable[[Command], Command]:
    """Return the option ``--format``, whose value is called `shape`; the first of `shapes` is its default."""
    return click.option("--format", "shape", type=click.Choice(shapes), default=shapes[0], show_default=True,
                        help="Output format.")  # fmt: skip


YES = click.option("--yes", is_flag=True, help="Do not prompt.")
RESULTS = click.option("--out", type=click.Path(path_type=Path), default=DEFAULT_FOLDER, show_default=True,
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
"""Options that `tactbench.core.study.simulation.simulation_of` reads."""
