"""Options that several verbs have, and those of the engine."""

from __future__ import annotations

import math
from collections.abc import Callable
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


def options(*several: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Return a decorator that adds options to a verb, in this order in its help."""

    def add(command: Command) -> Command:
        for option in reversed(several):
            command = option(command)
        return command

    return add


ENGINE = (
    click.option(
        "--engine",
        type=click.Choice(("in-process", "isolated", "dask")),
        help="Where cells are carried out: in child processes (the default), on a Dask cluster, or in the run's "
        "own process, without limits, for a debugger.",
    ),
    click.option(
        "--jobs", type=click.IntRange(min=1), metavar="N", help="Processes at once. Default: one for each usable core."
    ),
    click.option(
        "--timeout",
        type=FiniteRange(min=0, min_open=True, max=MOST_SECONDS),
        metavar="SECONDS",
        help="What one cell, or one recording, may take. Default: no limit, since a slow estimator on much data may "
        "rightly take hours.",
    ),
    click.option(
        "--memory",
        type=click.IntRange(min=1, max=MOST_MEMORY_MB),
        metavar="MB",
        help="Memory that one cell, or one recording, may take beyond the libraries that all share. "
        "Default: no limit; if the system runs out of it, cells are ended first.",
    ),
    click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler for --engine dask. Default: a local cluster."),
)
