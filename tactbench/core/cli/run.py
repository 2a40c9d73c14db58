"""``tactbench run``: acquires recordings, evaluates the cells of a matrix and ranks them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from tactbench.core.cli.leaderboard import TABLE_FORMATS, print_table
from tactbench.core.cli.listing import remark_failed
from tactbench.core.cli.shared import JOBS, RESULTS, SIMULATION, YES, FiniteRange, format_option, options
from tactbench.core.leaderboard.formats import write_tables
from tactbench.core.leaderboard.names import DEFAULT
from tactbench.core.leaderboard.table import over_all
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.matrix import MOST_MEMORY_MB, MOST_REPEATS, MOST_SECONDS
from tactbench.core.study.files import table_of
from tactbench.core.study.study import Study, carry_out
from tactbench.core.tables.terminal import remark
from tactbench.core.tables.text import command_line, cut


@click.command(name="run")
@options(
    click.option("--sensor", multiple=True, metavar="NAME", help="Sensor; repeatable."),
    click.option("--task", multiple=True, metavar="NAME", help="Task; repeatable."),
    click.option("--rig", metavar="NAME", help="Rig: twin (default), replay, or one of a rig file."),
    click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings to replay."),
    click.option("--dataset", multiple=True, metavar="NAME",
                 help="Public data set (see `tactbench datasets`) or its mapping file; fetched once; repeatable."),
    click.option("--rig-file", metavar="FILE", help="Devices and links of a rig of real or emulated devices."),
    click.option("--protocol", multiple=True, metavar="NAME",
                 help="Evaluation protocol; repeatable. Default: the task's first."),
    click.option("--split", multiple=True, metavar="NAME",
                 help="Train/test split: roles, session, placement, unit, few-shot, …; repeatable."),
    click.option("--estimator", multiple=True, metavar="NAME",
                 help="Estimator; repeatable; `all` for every one that fits."),
    click.option("--config", metavar="FILE", help="Matrix file like benchmarks.yaml, or the name of a packaged one."),
    click.option("--repeats", type=click.IntRange(min=1, max=MOST_REPEATS), metavar="N",
                 help="Number of replicates, each with its own seed. Default: 8 if simulated, else 1."),
    click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of the first replicate."),
    click.option("--probe", is_flag=True, help="Add leakage probes: first frame only, shuffled rows."),
    click.option("--include-incomplete", is_flag=True,
                 help="Include recordings with more missing samples than their rig file allows."),
    SIMULATION,
    click.option("--engine", type=click.Choice(("in-process", "isolated", "dask")), default="isolated",
                 help="Run cells in child processes, on a Dask cluster, or in this process (for a debugger)."),
    JOBS,
    click.option("--timeout", type=FiniteRange(min=0, min_open=True, max=MOST_SECONDS), metavar="SECONDS",
                 help="Time limit per cell and per recording. Default: none."),
    click.option("--memory", type=click.IntRange(min=1, max=MOST_MEMORY_MB), metavar="MB",
                 help="Memory limit per cell and per recording, beside shared libraries. Default: none."),
    click.option("--root", type=click.Path(path_type=Path), metavar="DIR",
                 help="Folder of a copy of the data sets; missing files are fetched."),
    RESULTS,
    YES,
)  # fmt: skip
@format_option(*TABLE_FORMATS)
@click.pass_context
def command(
    ctx: click.Context, /, shape: str, estimator: tuple[str, ...], settings: tuple[str, ...], **options_given: Any
) -> None:
    """Acquire recordings, evaluate sensors and estimators on tasks, and rank the results.

    Without options: the whole of benchmarks.yaml. Options select from this file or replace its choices. Finished cells
    in the result folder are reused.
    """
    remark_failed(installed())
    store, outcome = carry_out(Study(estimator=estimator or None, set=settings, **options_given))
    table = table_of(store, over_all(store, outcome.rows))
    print_table(table, shape, DEFAULT)
    write_tables(table, store.folder)
    count = len(outcome.rows)
    remark(f"\n{count - outcome.computed} of {count} answers were found finished, {outcome.computed} computed now; "
           f"{outcome.recorded} recordings made now.")  # fmt: skip
    if store.superseded:
        remark(f"{len(store.superseded)} answers supersede those of the same cells from other recordings: tables "
               "show the latest answers. Another --out DIR keeps both.")  # fmt: skip
    remark(f"Files: {store.folder}/leaderboard.md, .csv, .json; results.sqlite; recordings/; cells/")
    remark(f"Next: {command_line('tactbench', 'report', str(store.folder))}")
    remark_stopped(outcome.failures, store.folder)
    ctx.exit(1 if outcome.failures else 0)


def remark_stopped(rows: Sequence[Mapping[str, Any]], folder: Path) -> None:
    """Print one line for each stopped cell with its reason, and the command that shows the details of the first."""
    if not rows:
        return
    remark(f"\nStopped cells: {len(rows)}.")
    for row in rows:
        reason = cut(" ".join(str(row["reason"]).split()), 200)
        remark(f"  {row['status']:<13}  {row['cell']}: {reason}")
    remark(f"Details of the first: {command_line('tactbench', 'why', str(rows[0]['cell']), '--out', str(folder))}")
