"""The options that say where cells are carried out, and what each may take."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.matrix.engine import EngineChoice, EngineName
    from tactbench.core.spec.matrix import MatrixSpec

_OPTIONS = (
    click.option(
        "--engine",
        type=click.Choice(("in-process", "isolated", "dask")),
        help="Where cells are carried out: each in a process of its own (the default), on a Dask cluster, or, a single "
        "cell, in the process of the run.",
    ),
    click.option(
        "--jobs", type=click.IntRange(min=1), default=1, show_default=True, metavar="N", help="Cells at once."
    ),
    click.option(
        "--timeout",
        type=click.FloatRange(min=0, min_open=True),
        metavar="SECONDS",
        help="What one cell, or one recording, may take. Default: no limit, since a slow estimator on much data may "
        "rightly take hours.",
    ),
    click.option(
        "--memory",
        type=click.IntRange(min=1),
        metavar="MB",
        help="Memory that one cell, or one recording, may take beyond libraries and recordings that all share. "
        "Default: no limit; if the system runs out of it, cells are ended first.",
    ),
    click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler for --engine dask. Default: a local cluster."),
)


def engine_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def choice_of(
    matrix: MatrixSpec,
    *,
    engine: EngineName | None,
    jobs: int,
    timeout: float | None,
    memory: int | None,
    scheduler: str | None,
) -> EngineChoice:
    """Return what the options ask for; limits that they leave open are those of the matrix file.

    Raises
    ------
    UsageError
        If options do not go together.
    """
    from tactbench.core.matrix.engine import EngineChoice
    from tactbench.core.pool.limits import Limits

    limits = Limits(
        timeout_s=matrix.timeout_s if timeout is None else timeout,
        memory_mb=matrix.memory_mb if memory is None else memory,
    )
    return EngineChoice(engine or "isolated", jobs, limits, scheduler).checked()
