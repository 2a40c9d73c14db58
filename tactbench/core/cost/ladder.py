"""What the accuracy of one sensor in one task costs in time, estimator by estimator, as a table of plain data."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.cost.ladder_rows import Record, by_score, mark_fronts, opening, stopped, timed
from tactbench.core.cost.rounds import BUDGET_S, THREADS, measure
from tactbench.core.cost.timed_estimators import TimedEstimator, timed_estimator
from tactbench.core.errors import UsageError
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.matrix.plan import plan_cells
from tactbench.core.matrix.progress import Progress
from tactbench.core.matrix.run import EngineChoice, Outcome, run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import Registry
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.statistics.replicates import over_replicates


class Ladder(NamedTuple):
    """The table, and what holds for all of it; keys as in `tactbench.core.cost.ladder_file`."""

    about: dict[str, Any]
    rows: list[Record]


def climb(
    matrix: MatrixSpec,
    registry: Registry,
    store: Store,
    *,
    rounds: int,
    clock: Callable[[], float],
    progress: Progress,
    recordings: Path | None = None,
    choice: EngineChoice | None = None,
) -> Ladder:
    """Score the estimators of `matrix` and time them.

    Parameters
    ----------
    matrix
        One sensor, one task. Scores are over its replicates, times of the first.
    store
        Cells that are in it are not scored again; timing is always done anew.
    rounds, clock
        As in `tactbench.core.cost.rounds.measure`.
    recordings
        Folder for rigs that replay.
    choice
        Where cells are scored; times are always measured in this process.

    Raises
    ------
    UsageError
        If something is asked for that is not there, more than one protocol or split, or a task of whole recordings.

    Returns
    -------
    Ladder
        A row for every estimator, also for those that were skipped or failed; the best score first.
    """
    ways = {(cell.protocol, cell.split) for cell in plan_cells(matrix, matrix.sensors, registry)}
    if len(ways) > 1:
        several = ", ".join(sorted(f"{protocol} {split or ''}".strip() for protocol, split in ways))
        raise UsageError(f"One ladder is for one protocol and one split, not {several}.", hint="Ask for one of them.")
    task = registry.tasks[matrix.tasks[0].name].spec
    if task.answer_per == "recording":
        raise UsageError(
            f"A ladder times answers to single rows; task {task.name!r} asks one of each recording.",
            hint="`tactbench run` tells fit time, latency and answer delay of its estimators.",
        )
    outcome = run_matrix(matrix, store, choice=choice, recordings=recordings, progress=progress)
    done = [row for row in outcome.rows if row["status"] == "done" and row["seed"] == matrix.seed]
    data = load_dataset(task, [store.folder / path for path in done[0]["recordings"]]) if done else None
    answers = over_replicates(outcome.rows)
    rows: dict[str, Record] = {}
    timed_estimators: dict[str, TimedEstimator] = {}
    for row in answers:
        descriptor = registry.estimators[row["estimator"]]
        rows[row["cell"]] = opening(row, descriptor)
        if row["status"] != "done" or data is None:
            continue
        try:
            timed_estimators[row["cell"]] = timed_estimator(
                task, descriptor, row["params"], row["protocol"], row["split"], data, seed=matrix.seed
            )
        except Exception as error:
            rows[row["cell"]] |= stopped(error)
    times = measure(timed_estimators, rounds=rounds, seed=matrix.seed, clock=clock, progress=progress)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    scores = {row["cell"].removesuffix(f"/{row['repeat']}"): row["scores"] for row in done}
    for cell, one in timed_estimators.items():
        rows[cell] |= timed(one, times[cell], scores[cell], rounds)
    better = metric_called(task.metric).higher_is_better
    found = by_score(list(rows.values()), higher_is_better=better)
    mark_fronts(found, higher_is_better=better)
    fold = next((one.fold for one in timed_estimators.values()), "")
    measured = {
        "higher_is_better": better, "fold": fold,
        "remarks": list(dict.fromkeys(remark for one in timed_estimators.values() for remark in one.remarks)),
        "rounds": rounds, "budget_s": BUDGET_S, "threads": THREADS, "load": load, "cores": os.cpu_count(),
    }  # fmt: skip
    return Ladder(_about(outcome) | measured, found)


def _about(outcome: Outcome) -> dict[str, Any]:
    """Return what the cells have in common."""
    first = next((row for row in outcome.rows if row["status"] == "done"), outcome.rows[0])
    keys = ("sensor", "task", "rig", "protocol", "split", "seed", "metric", "unit", "simulated", "dagger")
    return {
        **{key: first[key] for key in keys},
        "provenance": {key: value for key, value in outcome.provenance.items() if key != "jobs"},
    }
