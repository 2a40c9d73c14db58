"""One cell to one row, whatever happens in it."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tactbench.core.errors import CellStopped, NotApplicable, TactbenchError
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.store import Row
from tactbench.core.plugins.registry import Registry
from tactbench.core.samples import Answers
from tactbench.core.spec.recording import RecordingMeta, Scalar
from tactbench.core.spec.row import RowModel
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec

if TYPE_CHECKING:
    from tactbench.core.evaluation.cell import CellResult
    from tactbench.core.evaluation.dataset import Dataset

Answer = tuple[Row, Mapping[Role, Answers]]
"""A row, and the answers that go into its shard, by role."""


def answer(
    cell: Cell,
    registry: Registry,
    recordings: Sequence[Path],
    dataset: Callable[[str, tuple[Path, ...]], Dataset],
    working: Callable[[str], None] | None = None,
) -> Answer:
    """Evaluate one cell; an exception becomes a row that says ``failed`` or ``skipped``.

    Raises
    ------
    MemoryError
        It is the engine that knows whether the cell took too much or there was too little.
    """
    from tactbench.core.evaluation.cell import evaluate

    task = registry.tasks[cell.task].spec
    row = opening(cell, task, simulated=registry.rigs[cell.rig].simulated)
    try:
        material = dataset(task.name, tuple(recordings))
        result = evaluate(
            task,
            registry.estimators[cell.estimator],
            dict(cell.params),
            cell.protocol,
            cell.split,
            recordings,
            seed=cell.seed,
            clock=time.perf_counter,
            threads=1,
            progress=working,
            dataset=material,
            latency=cell.latency,
        )
    except NotApplicable as reason:
        return {**row, "status": "skipped", "reason": str(reason)}, {}
    except MemoryError:
        raise
    except Exception as error:
        return stopped(row, error), {}
    metas = [material.metas[place] for place in range(len(material.metas))]
    row.update(_told_by(metas))
    row.update(_scored(result))
    row["remarks"] = [*row["remarks"], *result.remarks]
    row.update(_published(cell, task, result.split))
    row["looks_at"] = registry.estimators[cell.estimator].looks_at
    row["recordings"] = [str(path) for path in material.paths]
    row["status"] = "done"
    return row, dict(result.sets)


ASKED = ("cell", "sensor", "task", "rig", "protocol", "estimator", "params", "is_baseline", "repeat", "repeats", "seed",
         "simulation", "metric", "unit", "equivalence", "reference_score")  # fmt: skip
"""What a row says of the question: computing the answer does not change it."""


def opening(cell: Cell, task: TaskSpec, *, simulated: bool = False) -> Row:
    """Return a row with what is known before anything is computed; every key of the format is there."""
    unknown = {name: field.get_default(call_default_factory=True) for name, field in RowModel.model_fields.items()}
    return {
        **unknown,
        "cell": cell.name,
        "sensor": cell.sensor,
        "task": cell.task,
        "rig": cell.rig,
        "protocol": cell.protocol,
        "split": cell.split,
        "estimator": cell.estimator,
        "params": dict(cell.params),
        "is_baseline": cell.baseline,
        "repeat": cell.repeat,
        "repeats": cell.repeats,
        "seed": cell.seed,
        "simulation": cell.simulation.model_dump(exclude_defaults=True),
        "status": "planned",
        "metric": task.metric,
        "unit": task.unit,
        "equivalence": task.equivalence,
        "reference_score": task.reference_score,
        "simulated": simulated,
        **_published(cell, task, cell.split),
    }


def reused(known: Row, cell: Cell, task: TaskSpec) -> Row:
    """Return the row of a finished cell as `cell` names it today, beside what is published today.

    Its key covers neither: they change no number of ours.
    """
    named = {"cell": cell.name, "repeat": cell.repeat, "repeats": cell.repeats}
    return {**known, **named, **_published(cell, task, known["split"])}


def _published(cell: Cell, task: TaskSpec, split: str | None) -> Row:
    """Return the published figure that the cell may stand beside: one of ours with its defaults only."""
    found = task.published_for(cell.sensor, cell.protocol, cell.estimator, split)
    if found is None or (cell.baseline if found.estimator is None else cell.params):
        return {"published": None, "published_reference": "", "published_remark": ""}
    own = "" if found.estimator else "another model than ours"
    remark = "; ".join(part for part in (own, found.remark) if part)
    return {"published": found.score, "published_reference": found.reference, "published_remark": remark}


def stopped(row: Row, error: BaseException) -> Row:
    """Return `row` saying how the cell was stopped; an exception that is no engine's word makes it ``failed``."""
    said = str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {_text(error)}"
    where = error.traceback_text if isinstance(error, TactbenchError) else ""
    if not where and error.__traceback__ is not None:
        where = "".join(traceback.format_exception(error))
    row = {**row, "status": "failed", "reason": said.rstrip(": "), "traceback": where}
    if isinstance(error, CellStopped):
        row |= {"status": error.status, "signal": error.signal, "log": error.log, "wall_s": error.spent_s}
    return row


def _text(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:
        return "(its text cannot be read)"


def _told_by(metas: Sequence[RecordingMeta]) -> Row:
    """Return what the recordings say that a reader of the row must know."""
    seconds = [float(meta.provenance["sim_s"]) for meta in metas if "sim_s" in meta.provenance]
    first = metas[0] if metas else None
    return {
        "simulated": any(meta.simulated for meta in metas),
        "emulated": any(meta.emulation is not None for meta in metas),
        "sim_s": sum(seconds) if seconds else None,
        "assumptions": _assumed(metas),
        "plan": [entry.model_dump() for entry in first.plan] if first else [],
        "remarks": sorted({remark for meta in metas for remark in meta.remarks}),
    }


def _assumed(metas: Sequence[RecordingMeta]) -> dict[str, Scalar]:
    """Return what a simulation assumed in all recordings; of what differs among them, the range or every value."""
    found: dict[str, Scalar] = {}
    for name in dict.fromkeys(name for meta in metas for name in meta.assumptions):
        values = list(dict.fromkeys(meta.assumptions[name] for meta in metas if name in meta.assumptions))
        numbers = [value for value in values if isinstance(value, int | float)]
        if len(values) == 1:
            found[name] = values[0]
        elif len(numbers) == len(values):
            found[name] = f"{min(numbers):g} to {max(numbers):g}"
        else:
            found[name] = ", ".join(str(value) for value in values)
    return found


_OF_FORCE = (
    "reference_floor", "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score",
    "true_ci_low", "true_ci_high",
)  # fmt: skip
"""What an error of force has besides its score; None where it cannot be said."""


def _of_force(result: CellResult) -> tuple[float | None, ...]:
    beyond = result.beyond
    known = (None,) * 4 if beyond is None else (beyond.floor, beyond.score, beyond.low, beyond.high)
    return *known, *(result.true or (None,) * 3)


def _scored(result: CellResult) -> Row:
    return {
        "split": result.split,
        "score": result.score,
        "ci_low": result.ci_low,
        "ci_high": result.ci_high,
        "ci_method": result.ci_method,
        **dict(zip(_OF_FORCE, _of_force(result), strict=True)),
        "tare_s": result.tare_s,
        "n_recordings": result.n_recordings,
        "n_sessions": result.n_sessions,
        "n_train": result.n_train,
        "n_test": result.n_test,
        "search_s": result.search_s,
        "fit_s": result.fit_s,
        "predict_s": result.predict_s,
        "batch_rows": result.batch_rows,
        "latency_ms_p50": result.latency_ms_p50,
        "latency_ms_p95": result.latency_ms_p95,
        "latency_ms_max": result.latency_ms_max,
        "latency_n": result.latency_n,
        "answer_delay_ms": result.answer_delay_ms,
        "delay_parts_ms": dict(result.delay_parts_ms),
        "threads": result.threads,
        "peak_rss_mb": result.peak_rss_mb,
        "dagger": result.dagger,
        "stamps": list(result.stamps),
        "counts": dict(result.counts),
        "chosen": dict(result.chosen),
        "search": [dict(candidate) for candidate in result.search],
        "scores": dict(result.scores),
        "fold_sizes": {name: list(sizes) for name, sizes in result.fold_sizes.items()},
        "confusion": None if result.confusion is None else result.confusion.tolist(),
        "classes": list(result.classes),
        "replicates": dict(result.replicates),
    }
