"""Options that several verbs have, and those of the engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tactbench.core.spec.bounds import MOST_MEMORY_MB, MOST_SECONDS

Command = Callable[..., Any]


class FiniteRange(click.FloatRange):
    """A range of numbers without NaN, which compares as inside of every range, and without infinity."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; fails with a usage error."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is no finite number.", param, ctx)
        return number


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
RESULTS = click.option("--out", type=click.Path(path_type=Path), default=Path("tactbench-results"), show_default=True,
                       metavar="DIR", help="Result folder.")  # fmt: skip

ENGINE = (
    click.option("--engine", type=click.Choice(("in-process", "isolated", "dask")), default="isolated",
                 show_default=True,
                 help="Run cells in child processes, on a Dask cluster, or in this process (for a debugger)."),
    click.option("--jobs", type=click.IntRange(min=1), metavar="N",
                 help="Parallel worker processes. Default: one per usable core."),
    click.option("--timeout", type=FiniteRange(min=0, min_open=True, max=MOST_SECONDS), metavar="SECONDS",
                 help="Time limit per cell and per recording. Default: none."),
    click.option("--memory", type=click.IntRange(min=1, max=MOST_MEMORY_MB), metavar="MB",
                 help="Memory limit per cell and per recording, beside shared libraries. Default: none."),
)  # fmt: skip
