"""Scores and times as one setting at a time is varied, and errors of a simulated rig against its computing time."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.evaluation.protocols import DEPLOYABLE, shots
from tactbench.core.matrix.run import EngineChoice, run_matrix
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.interfaces import CostPoint, CostStudy
from tactbench.core.plugins.registry import Registry
from tactbench.core.progress import Progress
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.spec.rig import EstimatorDescriptor, RigDescriptor
from tactbench.core.spec.row import lower_is_better
from tactbench.core.spec.scene import Simulation
from tactbench.core.spec.task import TaskSpec
from tactbench.core.statistics.replicates import over_replicates

P = TypeVar("P")
SHARE = 1 / 3
"""Share of an observable's noise below which an error changes scores little."""


def front(points: Sequence[P], cost_of: Callable[[P], tuple[float, float]]) -> list[P]:
    """Return the points that no other point beats in both time and error, by increasing time.

    Parameters
    ----------
    cost_of
        Function that returns the time and the error of a point; smaller is better for both.
    """
    kept: list[P] = []
    for point in sorted(points, key=cost_of):
        if not kept or cost_of(point)[1] < cost_of(kept[-1])[1]:
            kept.append(point)
    return kept


class Skipped(NamedTuple):
    """A setting of the simulation that is not possible for a sensor, with the reason."""

    subject: str
    label: str
    reason: str


def measured(study: CostStudy, subject: str, progress: Progress) -> Iterator[CostPoint | Skipped]:
    """Carry out the jobs of a cost study; yield the measured points, and `Skipped` for jobs that are not possible."""
    progress.begin(subject, len(study.jobs))
    for job in study.jobs:
        progress.working(job.label)
        try:
            yield from job.run()
        except TactbenchError as error:
            yield Skipped(subject, job.label, str(error))
        progress.advance(job.label)


def diagrams(points: Sequence[CostPoint]) -> dict[tuple[str, str], list[CostPoint]]:
    """Return the points of each diagram by (subject, observable), sorted by time."""
    found: dict[tuple[str, str], list[CostPoint]] = {}
    for point in points:
        found.setdefault((point.subject, point.observable), []).append(point)
    return {key: sorted(group, key=lambda point: point.seconds) for key, group in found.items()}


def precise(points: Sequence[CostPoint]) -> list[CostPoint]:
    """Return the front of a diagram: points that no other beats in both seconds and error."""
    return front(points, lambda point: (point.seconds, point.error))


TREES = (3, 10, 30, 100, 300)
WINDOWS = (0, 2, 5, 10, 20, 40)
EVERY = (1, 2, 5, 10, 20)
TOLERANCES = (3.0, 1.0, 0.3)
"""Values tried for each setting (trees, window, every n-th sample, tolerance), defaults included."""
TIMES = {
    "trees": "answer_delay_ms", "window k": "answer_delay_ms", "every n-th sample": "answer_delay_ms",
    "estimator": "answer_delay_ms", "training sessions": "fit_s", "rung": "sim_s", "tolerance": "sim_s",
}  # fmt: skip
"""Key of the time that is affected by each varied setting."""
BOUGHT = ("estimator", "trees", "window k", "every n-th sample")
"""Settings that are evaluated on the same task and recordings, so that their values compete for the front."""
_KEPT = (
    "score", "ci_low", "ci_high", "protocol", "split", "estimator", "params", "simulation", "status", "reason",
    "n_replicates", "n_train", "n_test", "fit_s", "latency_ms_p50", "answer_delay_ms", "delay_parts_ms", "sim_s",
    "remarks",
)  # fmt: skip

Record = dict[str, Any]


class Setting(NamedTuple):
    """One value of one varied setting (`knob`), with all others at their defaults."""

    knob: str
    value: str
    protocol: str
    estimator: EstimatorChoice
    split: str | None = None
    simulation: Simulation = Simulation()


def quick_estimator(registry: Registry, task: str) -> str:
    """Return the name of a linear estimator for `task` without parameter search, preferably one of the task's own.

    If there is no such estimator, return the first estimator for the task.

    Raises
    ------
    UsageError
        If no estimator for this kind of task is installed, except for trivial ones.
    """
    spec = registry.tasks[task].spec
    fitting = [registry.estimators[name] for name in spec.estimators]
    fitting += [one for one in registry.estimators if spec.kind in one.kinds and not one.baseline]
    if not fitting:
        raise UsageError(f"No estimator for task {task!r} is installed.", hint="See `tactbench list estimators`.")
    return next((one.name for one in fitting if one.linear and not one.grid), fitting[0].name)


def task_score(registry: Registry, rig: str, sensor: str, task: str, simulation: Simulation, progress: Progress) -> Row:
    """Simulate every scene of `task` in a temporary folder and return the result row of a quick estimator."""
    estimator = quick_estimator(registry, task)
    choice = TaskChoice(name=task, estimators=(EstimatorChoice(name=estimator),))
    matrix = MatrixSpec(
        rig=rig, seed=1, repeats=1, sensors=(sensor,), tasks=(choice,), simulation=simulation, latency=False
    )
    with tempfile.TemporaryDirectory(prefix="tactbench-score-") as folder:
        outcome = run_matrix(matrix, Store(Path(folder)), progress=progress)
    return next(row for row in outcome.rows if row["estimator"] == estimator)


def settings_of(task: TaskSpec, estimators: Sequence[EstimatorDescriptor], protocol: str) -> Iterator[Setting]:
    """Yield the settings varied for the first of `estimators`, and each of `estimators` with its defaults."""
    first, plain = estimators[0], EstimatorChoice(name=estimators[0].name)
    own = first.params.get("n_estimators")
    for trees in sorted({*TREES, own}) if isinstance(own, int) else ():
        changed = EstimatorChoice(name=first.name, params={"n_estimators": trees})
        yield Setting("trees", str(trees), protocol, plain if trees == own else changed)
    if task.answer_per != "frame" and not task.summaries:
        for k in WINDOWS:
            yield Setting("window k", str(k), protocol if first.window_grid == (k,) else f"{protocol}@k={k}", plain)
        for every in EVERY:
            yield Setting(
                "every n-th sample", str(every), f"{protocol}@every={every}" if every > 1 else protocol, plain
            )
    for split in task.splits:
        if shots(split) and DEPLOYABLE.name in task.protocols:
            yield Setting("training sessions", str(shots(split)), DEPLOYABLE.name, plain, split)
    for one in estimators:
        yield Setting("estimator", one.name, protocol, EstimatorChoice(name=one.name))


def simulations_of(rig: RigDescriptor, estimator: EstimatorDescriptor, protocol: str) -> Iterator[Setting]:
    """Yield the settings of a simulated rig: its solvers (rungs) except for the slowest, and tolerances."""
    plain = EstimatorChoice(name=estimator.name)
    for rung in rig.rungs[:-1]:
        yield Setting("rung", rung, protocol, plain, None, Simulation(rung=rung))
    for tolerance in TOLERANCES:
        yield Setting("tolerance", f"{tolerance:g}", protocol, plain, None, Simulation(tolerance=tolerance))


def measure(
    matrix: MatrixSpec, settings: Sequence[Setting], folder: Path, *, choice: EngineChoice | None = None,
    recordings: Path | None = None, progress: Progress,
) -> dict[str, Any]:  # fmt: skip
    """Evaluate every setting as cells of a result folder and return the scores and times.

    Parameters
    ----------
    matrix
        Rig, first seed, number of replicates, one sensor and one task.
    folder
        Result folder; each simulation other than the default one has its own folder in it. Finished cells are reused.

    Returns
    -------
    dict
        ``sensor``, ``task``, ``rig``, ``protocol``, ``metric``, ``unit``, ``simulated``, ``dagger``, ``seed``,
        ``trivial`` (the best score without any input, or None), ``replicates``, and ``settings``: a
        record for each setting, in the order of `settings`.
    """
    task = matrix.tasks[0].name
    records: list[Record] = []
    rows: list[Row] = []
    for one in settings:
        split = (one.split,) if one.split else ()
        tasks = (TaskChoice(name=task, protocol=(one.protocol,), split=split, estimators=(one.estimator,)),)
        store = Store(folder if one.simulation == Simulation() else folder / f"{one.knob}-{one.value}")
        part = matrix.model_copy(update={"simulation": one.simulation, "tasks": tasks})
        outcome = run_matrix(part, store, choice=choice, recordings=recordings, progress=progress)
        own = over_replicates(outcome.rows)
        wanted = one.estimator.name, dict(one.estimator.params)
        row = next(row for row in own if (row["estimator"], row["params"]) == wanted)
        records.append({"knob": one.knob, "value": one.value, **{key: row[key] for key in _KEPT}, "front": False})
        rows += own
    first = next((row for row in rows if row["status"] == "done"), rows[0])
    sign = 1.0 if lower_is_better(first["metric"]) else -1.0
    trivial = [
        sign * row["score"] for row in rows
        if (row["looks_at"], row["status"]) == ("nothing", "done")
        and (row["protocol"], row["split"]) == (first["protocol"], first["split"])
    ]  # fmt: skip
    bar = min(trivial, default=math.inf)
    competing = [
        one for one in records
        if one["knob"] in BOUGHT and one["status"] == "done" and one["answer_delay_ms"] is not None
        and sign * one["score"] < bar
    ]  # fmt: skip
    for best in front(competing, lambda one: (one["answer_delay_ms"], sign * one["score"])):
        best["front"] = True
    about = {key: first[key] for key in ("sensor", "task", "rig", "protocol", "metric", "unit", "simulated", "dagger")}
    shown = sign * bar if trivial else None
    return {**about, "seed": matrix.seed, "trivial": shown, "replicates": matrix.repeats, "settings": records}
