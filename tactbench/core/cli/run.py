"""``tactbench run``: acquire, evaluate, rank."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import ENGINE, RESULTS, YES, format_option, options
from tactbench.core.cli.selection import SELECTING, requested_matrix
from tactbench.core.cli.tables import TABLE_FORMATS, check_destination, print_table, view_of
from tactbench.core.cli.threads import keep_threads

if TYPE_CHECKING:
    from tactbench.core.matrix.run import EngineName, Outcome
    from tactbench.core.matrix.store import Store
    from tactbench.core.spec.matrix import MatrixSpec

_REASON_CHARACTERS = 200
"""Of a reason that are shown; the whole of it is in the row."""


@click.command(name="run")
@options(*SELECTING, *ENGINE)
@click.option("--root", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder of a copy of the data sets; what is not there is fetched.")  # fmt: skip
@RESULTS
@YES
@format_option(*TABLE_FORMATS)
@click.pass_context
def command(ctx: click.Context, /, shape: str, **asked: Any) -> None:
    """Acquire, evaluate, rank.

    Without options: the whole of benchmarks.yaml. Options select from it or replace its choices. What the result folder
    holds already is reused.
    """
    check_destination(shape)
    keep_threads()
    from tactbench.core.cli.listing import tell_failed
    from tactbench.core.cli.results import table_of
    from tactbench.core.leaderboard.formats import write_tables
    from tactbench.core.leaderboard.table import over_all
    from tactbench.core.plugins.registry import installed

    tell_failed(installed())
    store, outcome = carry_out(**asked)
    table = table_of(store, over_all(store, outcome.rows))
    print_table(table, shape, view_of(store.folder))
    write_tables(table.rows, store.folder, table.provenance, table)
    _farewell(outcome, store.folder)
    ctx.exit(1 if outcome.failures else 0)


def carry_out(
    *,
    out: Path,
    yes: bool,
    engine: EngineName,
    jobs: int | None,
    timeout: float | None,
    memory: int | None,
    root: Path | None = None,
    changed: Callable[[MatrixSpec, Path | None], MatrixSpec] = lambda matrix, _: matrix,
    **selection: Any,
) -> tuple[Store, Outcome]:
    """Run what the verb's options ask for, and show the progress; return the result folder and how cells ended.

    `changed` is given the matrix and the folder of recordings that were asked for, and returns the matrix that is run.
    """
    from tactbench.core.cli.operator import TerminalOperator
    from tactbench.core.cli.progress import progress
    from tactbench.core.matrix.run import EngineChoice, run_matrix
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.registry import installed
    from tactbench.core.pool import Limits

    matrix, recordings = requested_matrix(installed(), **selection)
    matrix = changed(matrix, recordings)
    limits = Limits(  # what the options leave open, the matrix file says
        timeout_s=matrix.timeout_s if timeout is None else timeout,
        memory_mb=matrix.memory_mb if memory is None else memory,
    )
    store = Store(out)
    with progress() as display:
        outcome = run_matrix(
            matrix, store, choice=EngineChoice(engine, jobs, limits), recordings=recordings, root=root,
            progress=display,
            operator=TerminalOperator(yes=yes, paused=display.paused) if matrix.rig_file else None,
            shown=lambda rows: display.show(lambda: _so_far(rows)),
        )  # fmt: skip
    return store, outcome


def _so_far(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the table of the replicates that are finished, as wide as the terminal."""
    from tactbench.core.cli.screen import console
    from tactbench.core.leaderboard.table import build_table
    from tactbench.core.leaderboard.view import grids
    from tactbench.core.statistics.replicates import over_replicates
    from tactbench.core.tables.terminal import plain_text

    return plain_text(grids(build_table(over_replicates(rows))), console().width)


def _farewell(outcome: Outcome, folder: Path) -> None:
    """Say what there is now, and where it lies."""
    from tactbench.core.cli.screen import remark

    found = len(outcome.rows) - outcome.computed
    remark(f"\n{found} of {len(outcome.rows)} answers were found finished, {outcome.computed} computed now; "
           f"{outcome.recorded} recordings made now.")  # fmt: skip
    remark(f"Files: {folder}/leaderboard.md, .csv, .json; results.sqlite; recordings/; cells/")
    tell_stopped(outcome.failures, folder)


def tell_stopped(rows: Sequence[Mapping[str, Any]], folder: Path) -> None:
    """Name every cell of `rows` with its reason in one line, and the commands that look into it."""
    if not rows:
        return
    from tactbench.core.cli.screen import remark
    from tactbench.core.tables.text import command_line, cut

    remark(f"\nStopped: {len(rows)}.")
    for row in rows:
        reason = cut(" ".join(str(row["reason"]).split()), _REASON_CHARACTERS)
        remark(f"  {row['status']:<13}  {row['cell']}: {reason}")
    which = str(rows[0]["cell"]), "--out", str(folder)
    remark(f"Look into one:  {command_line('tactbench', 'why', *which)}")
    remark(f"Try it again:   {command_line('tactbench', 'why', *which, '--again')}")
