"""``tactbench choose``: the leaderboard with one column for each requirement: met, missed or unknown."""

from __future__ import annotations

from pathlib import Path

import click

from tactbench.core.cli.shared import ABOVE_0, DEFAULT_FOLDER, format_option
from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.formats import grids, json_array
from tactbench.core.leaderboard.requirements import COLUMNS, Requirements, with_requirements
from tactbench.core.leaderboard.table import build_table
from tactbench.core.plugins.registry import load_registry
from tactbench.core.study.files import is_results, opened, shipped_rows, shown_rows
from tactbench.core.tables.terminal import remark, show

_PREFERRED = "deployable"


@click.command(name="choose")
@click.argument("folder", type=click.Path(path_type=Path), required=False)
@click.option("--task", "task_name", required=True, metavar="NAME", help="Task.")
@click.option("--max-delay-ms", type=ABOVE_0, metavar="X", help="Largest delay from touch to answer.")
@click.option("--range-n", type=ABOVE_0, metavar="X", help="Largest normal force to measure.")
@click.option("--rate-hz", type=ABOVE_0, metavar="X", help="Smallest rate of answers.")
@click.option("--protocol", metavar="NAME", help="Evaluation protocol. Default: deployable, or one with results.")
@format_option("table", "json")
def command(
    folder: Path | None, task_name: str, max_delay_ms: float | None, range_n: float | None, rate_hz: float | None,
    protocol: str | None, shape: str,
) -> None:  # fmt: skip
    """Find the sensors that meet given requirements, and show which requirements are missed or unknown.

    FOLDER is that of `run --out`. Default: tactbench-results, or the results installed with tactbench if this folder
    has no results of the task.
    """
    registry = load_registry()
    task = registry.tasks[task_name].spec
    own = folder or DEFAULT_FOLDER
    rows = shown_rows(opened(own)) if folder is not None or is_results(own) else []
    origin = f"the results in {own}"
    if folder is None and task.name not in {row["task"] for row in rows}:
        rows, origin = shipped_rows()
    rows = [row for row in rows if row["task"] == task.name]
    protocols = [row["protocol"] for row in rows] or [_PREFERRED]
    protocol = protocol or (_PREFERRED if _PREFERRED in protocols else protocols[0])
    found = [row for row in rows if row["protocol"] == protocol]
    if not found:
        raise UsageError(
            f"There are no results of the task {task.name} under the protocol {protocol} in {own}.",
            hint=f"Compute them: `tactbench run --task {task.name} --protocol {protocol}`.",
        )
    specs = {one.name: one.spec for one in registry.sensors}
    table = build_table(found, questions={task.name: task.question})
    table = with_requirements(table, Requirements(max_delay_ms, range_n, rate_hz), task, specs)
    if shape == "json":
        click.echo(json_array(table), nl=False)
    else:
        show([grid.compact() for grid in grids(table, COLUMNS)])
    remark(f"\nSource: {origin}.")
