"""``tactbench sensitivity``: shows how scores depend on the assumptions of the simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.shared import JOBS, RESULTS, SIMULATION, format_option, options, print_tables
from tactbench.core.leaderboard.sensitivity import sensitivity_tables
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.matrix import MOST_REPEATS
from tactbench.core.study.study import Study, carry_out_sensitivity
from tactbench.core.tables.terminal import remark


@click.command(name="sensitivity")
@options(
    click.option("--sensor", multiple=True, metavar="NAME", help="Sensor; repeatable."),
    click.option("--task", metavar="NAME", required=True, help="Task."),
    click.option("--estimator", multiple=True, metavar="NAME", help="Estimator; repeatable."),
    click.option("--protocol", metavar="NAME", help="Evaluation protocol. Default: the task's first."),
    click.option("--nuisance", "nuisances", multiple=True, metavar="NAME",
                 help="Nuisance; repeatable. Default: all whose range a sensor states."),
    click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), metavar="N", help="Number of campaigns."),
    SIMULATION,
    JOBS,
    RESULTS,
)  # fmt: skip
@format_option("table", "md", "latex")
@click.pass_context
def command(
    ctx: click.Context, /, estimator: tuple[str, ...], nuisances: tuple[str, ...], settings: tuple[str, ...],
    shape: str, out: Path, **options_given: Any,
) -> None:  # fmt: skip
    """Show how simulated scores and the order of sensors depend on assumptions.

    Every nuisance is set to both ends of its range, and the most influential nuisances in pairs, on the same seeds.
    Finished cells are reused; each combination of ends has its own folder in OUT/assumptions.
    """
    study = Study(out=out, estimator=estimator or None, set=settings, **options_given)
    stopped = carry_out_sensitivity(study, nuisances)
    specs = {sensor.name: sensor.spec for sensor in installed().sensors}
    print_tables(sensitivity_tables(Store(out), specs), shape)
    for row in stopped:
        remark(f"{row['status']}: {row['cell']}: {row['reason']}")
    ctx.exit(1 if stopped else 0)
