"""``tactbench run``: acquire, evaluate, rank."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.simulation import simulation_of, simulation_options
from tactbench.core.cli.tables import TABLE_FORMATS, print_rows
from tactbench.core.cli.threads import one_thread

if TYPE_CHECKING:
    from tactbench.core.matrix.run import Outcome
    from tactbench.core.spec.matrix import MatrixSpec


@click.command(name="run")
@click.option("--sensor", "sensors", multiple=True, metavar="NAME", help="Sensor to test; may be repeated.")
@click.option("--task", "tasks", multiple=True, metavar="NAME", help="Question to ask; may be repeated.")
@click.option("--rig", metavar="NAME", help="What carries out the scenes: twin (default), replay …")
@click.option("--recordings", type=click.Path(path_type=Path), metavar="DIR", help="Recordings for --rig replay.")
@click.option(
    "--protocol",
    "protocols",
    multiple=True,
    metavar="NAME",
    help="How recordings become X and y; may be repeated. Default: the task's first.",
)
@click.option(
    "--split",
    "splits",
    multiple=True,
    metavar="NAME",
    help="What is kept apart: roles, session, placement, unit, few-shot, object …; may be repeated.",
)
@click.option(
    "--estimator",
    "estimators",
    multiple=True,
    metavar="NAME",
    help="What answers; may be repeated. all: every one for this kind of question.",
)
@click.option("--config", metavar="FILE", help="A matrix like benchmarks.yaml, or the name of a packaged one.")
@click.option("--repeats", type=click.IntRange(min=1), metavar="N", help="Repeat everything with N seeds.")
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of the first repeat.")
@click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True, metavar="N", help="Processes.")
@click.option("--probe", is_flag=True, help="Also ask what the recordings give away: first frame alone, shuffled rows.")
@click.option("--latency/--no-latency", default=None, help="Measure how long one row takes, up to 0.3 s a cell.")
@simulation_options
@click.option("--out", type=click.Path(path_type=Path), default=Path("tactbench-results"), show_default=True,
              metavar="DIR", help="Where results lie; what is there already is reused.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(TABLE_FORMATS), default="table", show_default=True,
              help="How the leaderboard is printed.")  # fmt: skip
@click.pass_context
def command(
    ctx: click.Context,
    /,
    jobs: int,
    out: Path,
    shape: str,
    probe: bool,
    latency: bool | None,
    recordings: Path | None,
    effects: str | None,
    rung: str | None,
    tolerance: float | None,
    **asked: Any,
) -> None:
    """Acquire, evaluate, rank.

    Without options: the whole of benchmarks.yaml. Options select from it or replace its choices.
    """
    one_thread()
    from tactbench.core.cli.screen import progress
    from tactbench.core.matrix.run import run_matrix
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.registry import load_registry

    matrix = _matrix(**asked, replaying=recordings is not None)
    simulation = simulation_of(load_registry(), matrix.rig, effects=effects, rung=rung, tolerance=tolerance)
    if probe:
        matrix = matrix.model_copy(update={"probe": True})
    if latency is not None:
        matrix = matrix.model_copy(update={"latency": latency})
    if simulation is not None:
        matrix = matrix.model_copy(update={"simulation": simulation})
    folder = recordings or (Path(matrix.recordings) if matrix.recordings else None)
    store = Store(out)
    with progress() as told:
        outcome = run_matrix(matrix, store, jobs=jobs, recordings=folder, progress=told)
    print_rows(outcome.rows, shape)
    if shape == "table":
        _side_by_side(outcome)
    _farewell(outcome, store.folder, shape)
    ctx.exit(1 if outcome.failures else 0)


def _matrix(
    *,
    sensors: tuple[str, ...],
    tasks: tuple[str, ...],
    rig: str | None,
    protocols: tuple[str, ...],
    splits: tuple[str, ...],
    estimators: tuple[str, ...],
    config: str | None,
    repeats: int | None,
    seed: int | None,
    replaying: bool,
) -> MatrixSpec:
    """Return the matrix file with the command line's choices laid over it."""
    from tactbench.core.cli.config import default_matrix, matrix_called
    from tactbench.core.spec.matrix import EstimatorChoice, TaskChoice

    matrix = matrix_called(config) if config else default_matrix()
    change: dict[str, Any] = {}
    if rig or replaying:
        change["rig"] = rig or "replay"
    if sensors:
        change["sensors"] = tuple(dict.fromkeys(sensors))
    elif change.get("rig", matrix.rig) != matrix.rig:
        change["sensors"] = ()  # the file's sensors are those of its own rig
    if repeats is not None:
        change["repeats"] = repeats
    if seed is not None:
        change["seed"] = seed
    chosen = list(matrix.tasks)
    if tasks:
        chosen = []
        for name in dict.fromkeys(tasks):
            chosen += [choice for choice in matrix.tasks if choice.name == name] or [TaskChoice(name=name)]
    over: dict[str, Any] = {}
    if protocols:
        over["protocol"] = tuple(dict.fromkeys(protocols))
    elif change.get("rig", matrix.rig) != matrix.rig:
        over["protocol"] = ("deployable",)  # the paper's protocol needs the paper's three roles
    if splits:
        over["split"] = tuple(dict.fromkeys(splits))
    if estimators:
        over["estimators"] = tuple(EstimatorChoice(name=name) for name in dict.fromkeys(estimators))
    change["tasks"] = tuple(choice.model_copy(update=over) for choice in chosen)
    return matrix.model_copy(update=change)


def _side_by_side(outcome: Outcome) -> None:
    """Print what was asked under several protocols or splits once more, side by side."""
    from tactbench.core.cli.comparisons import print_comparisons
    from tactbench.core.leaderboard.comparison import compare

    for by in ("protocol", "split"):
        if compare(outcome.rows, by):
            print_comparisons(outcome.rows, by, "table")


def _farewell(outcome: Outcome, folder: Path, shape: str) -> None:
    """Write the table's files; say where they are and what to try next."""
    from tactbench.core.cli.screen import remark
    from tactbench.core.leaderboard.formats import FORMATS as TEXTS
    from tactbench.core.matrix.files import replace_file
    from tactbench.core.matrix.store.disk import writing

    with writing(folder):
        for ending in ("md", "csv", "json"):
            replace_file(folder / f"leaderboard.{ending}", TEXTS[ending](outcome.rows).encode())
    cells = len(outcome.rows)
    remark(f"\n{cells - outcome.computed} of {cells} cells were found finished, {outcome.computed} computed now; "
           f"{outcome.recorded} recordings made now.")  # fmt: skip
    remark(f"Files: {folder}/leaderboard.md, .csv, .json; scores.json; recordings/; cells/; run.json")
    for row in outcome.failures:
        remark(f"Failed: {row['cell']}: {row['reason']}")
    if shape == "table":
        _suggest(outcome.rows[0])


def _suggest(row: Mapping[str, Any]) -> None:
    """Say what to try next, fitting to what was just run."""
    from tactbench.core.cli.screen import remark

    if row["simulated"]:
        tries = {
            "tactbench run": "the paper's whole matrix",
            f"tactbench run --task {row['task']} --protocol deployable": "without looking at test-set statistics",
            f"tactbench show {row['sensor']}": "what the sensor is, and who says so",
        }
    else:
        tries = {
            "tactbench run … --probe": "what the recordings give away: first frame alone, shuffled rows",
            "tactbench run … --estimator forest": "another answer (see tactbench list estimators)",
            "tactbench inspect FILE": "what is in a recording, and whether it is healthy",
        }
    width = max(len(command) for command in tries)
    remark("Try next:")
    for command_text, why in tries.items():
        remark(f"  {command_text:<{width}}  {why}")
