"""What the accuracy of one sensor in one task costs in time, estimator by estimator, as a table of plain data."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tactbench.core.cost.precision import front
from tactbench.core.cost.rounds import THREADS, TimedEstimator, Timing, measure, timed_estimator
from tactbench.core.errors import NotApplicable, UsageError, error_text
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.delay import answer_delay_ms, tail_ms
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.matrix.run import EngineChoice, Outcome, run_matrix
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import Registry
from tactbench.core.progress import Progress
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.statistics.replicates import over_replicates

Record = dict[str, Any]
_MEASURED = (
    "n_train", "n_test", "n_features", "fit_s", "fit_s_q1", "fit_s_q3", "fits", "batch_s_per_row", "batches",
    "latency_ms_p50", "latency_ms_p95", "latency_ms_max", "latency_n", "answer_delay_ms", "answer_delay_ms_q1",
    "answer_delay_ms_q3",
)  # fmt: skip


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
        If something is asked for that is not there, or a task of whole recordings.

    Returns
    -------
    Ladder
        A row for every estimator, also for those that were skipped or failed; the best score first.
    """
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
    for cell, one in timed_estimators.items():
        rows[cell] |= timed(one, times[cell])
    better = metric_called(task.metric).higher_is_better
    found = by_score(list(rows.values()), higher_is_better=better)
    mark_fronts(found, higher_is_better=better)
    fold = next((one.fold for one in timed_estimators.values()), "")
    measured = {
        "higher_is_better": better, "fold": fold,
        "remarks": list(dict.fromkeys(remark for one in timed_estimators.values() for remark in one.remarks)),
        "rounds": rounds, "threads": THREADS, "load": load, "cores": os.cpu_count(),
    }  # fmt: skip
    return Ladder(_about(outcome, answers) | measured, found)


def _about(outcome: Outcome, answers: Sequence[Row]) -> dict[str, Any]:
    """Return what the cells have in common."""
    first = next((row for row in answers if row["status"] == "done"), answers[0])
    keys = ("sensor", "task", "rig", "protocol", "split", "seed", "metric", "unit", "simulated", "dagger")
    return {
        **{key: first[key] for key in keys},
        "provenance": {key: value for key, value in outcome.provenance.items() if key != "jobs"},
    }


def opening(row: Row, descriptor: EstimatorDescriptor) -> Record:
    """Return what a cell's row says of an estimator; what is still to be measured is None."""
    kept = ("chosen", "status", "reason", "score", "ci_low", "ci_high", "ci_method", "search_s")
    return {
        "estimator": row["estimator"],
        "is_baseline": row["is_baseline"],
        "looks_at": descriptor.looks_at,
        "params": {**descriptor.params, **row["params"]},
        **{key: row[key] for key in kept},
        **dict.fromkeys(_MEASURED),
        "delay_parts_ms": {},
        "front_fit": False,
        "front_delay": False,
    }


def stopped(error: Exception) -> Record:
    """Return what changes in a row whose estimator could not be timed: it was skipped, or failed, and why."""
    reason = error_text(error)
    return {"status": "skipped" if isinstance(error, NotApplicable) else "failed", "reason": reason}


def timed(one: TimedEstimator, timing: Timing) -> Record:
    """Return what changes in a row by having been timed."""
    if timing.trouble is not None:
        return stopped(timing.trouble)
    quartiles = {
        name: np.quantile(1e3 * np.array(spent), (0.25, 0.5, 0.75))
        for name, spent in (("prediction", timing.latency_s), ("features", timing.features_s))
        if spent
    }
    parts = {**one.delay_parts_ms, **{name: float(median) for name, (_, median, _) in quartiles.items()}}
    low, median, high = sum(quartiles.values()).tolist()  # type: ignore[union-attr]
    delay = answer_delay_ms(parts, one.looks_at)
    p95, largest = tail_ms(np.array(timing.latency_s))
    fit_q1, fit_s, fit_q3 = np.quantile(timing.fit_s, (0.25, 0.5, 0.75)).tolist()
    return {
        "n_train": len(one.X_train),
        "n_test": len(one.X_test),
        "n_features": one.X_train.shape[1],
        "fit_s": fit_s,
        "fit_s_q1": fit_q1,
        "fit_s_q3": fit_q3,
        "fits": len(timing.fit_s),
        "batch_s_per_row": float(np.median(timing.batch_s)) / len(one.X_test),
        "batches": len(timing.batch_s),
        "latency_ms_p50": parts["prediction"],
        "latency_ms_p95": p95,
        "latency_ms_max": largest,
        "latency_n": len(timing.latency_s),
        "answer_delay_ms": delay,
        "answer_delay_ms_q1": None if delay is None else delay + low - median,
        "answer_delay_ms_q3": None if delay is None else delay + high - median,
        "delay_parts_ms": parts,
    }


def mark_fronts(rows: Sequence[Record], *, higher_is_better: bool) -> None:
    """Mark who is beaten by nobody.

    Trivial answers compete with nobody: they do not look at the sensor. Nor does who is no better than the best of
    those that look at nothing.
    """
    sign = -1.0 if higher_is_better else 1.0
    done = [row for row in rows if row["status"] == "done"]
    trivial = (row for row in done if row["is_baseline"] and row.get("looks_at") not in ("time", "reference"))
    bar = min((sign * row["score"] for row in trivial), default=float("inf"))
    able = [row for row in done if not row["is_baseline"] and sign * row["score"] < bar]
    for mark, time in (("front_fit", "fit_s"), ("front_delay", "answer_delay_ms")):
        measured = [row for row in able if row[time] is not None]
        for row in front(measured, seconds=lambda row, key=time: row[key], error=lambda row: sign * row["score"]):  # type: ignore[misc]
            row[mark] = True


def by_score(rows: Sequence[Record], *, higher_is_better: bool) -> list[Record]:
    """Return the rows, the best score first; those without one last, in the order given."""
    sign = -1.0 if higher_is_better else 1.0
    scored = [row for row in rows if row["score"] is not None]
    return sorted(scored, key=lambda row: float(sign * row["score"])) + [row for row in rows if row["score"] is None]
