"""One cell: carried out in whatever process an engine has chosen for it, to one row."""

from __future__ import annotations

import os
import platform
import random
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tactbench.core.errors import CellStopped, EngineError, NotApplicable, RecordingError
from tactbench.core.evaluation.warm_up import import_libraries
from tactbench.core.matrix.plan import Cell, task_of
from tactbench.core.matrix.store import Row
from tactbench.core.plugins.registry import installed, load_object
from tactbench.core.pool.log import printed
from tactbench.core.pool.message import dump_error, load_error
from tactbench.core.provenance.gather import host_id
from tactbench.core.spec.recording import RecordingMeta, Scalar
from tactbench.core.spec.row import RowModel
from tactbench.core.spec.task import TaskSpec

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset


class Job(NamedTuple):
    """A cell to be evaluated."""

    cell: Cell
    recordings: tuple[Path, ...]
    digests: tuple[str, ...] = ()
    """Of the recordings' content, which a process on another machine compares with what it reads; none: it need not."""


this_host = lru_cache(maxsize=1)(host_id)


def prepare(estimator: str, kind: str) -> None:
    """Import what an estimator needs, and have it learn a few made-up rows, before any clock is read.

    Done once in a process; a child process does it again, since a fork copies each page of memory when it is first
    written to. What is wrong with the estimator is left to its cells.
    """
    here = os.getpid(), estimator, kind
    if here in _prepared:
        return
    _prepared.add(here)
    with suppress(Exception):
        descriptor = installed().estimators[estimator]
        build = load_object(descriptor.where)
        build(kind=kind, seed=0, threads=1, **descriptor.params)
        if descriptor.rehearsal is not None:
            from tactbench.core.evaluation.warm_up import rehearse

            rehearse(build(kind=kind, seed=0, threads=1, **{**descriptor.params, **descriptor.rehearsal}), kind)


_prepared: set[tuple[int, str, str]] = set()
"""By process, estimator and kind of question."""


@lru_cache(maxsize=2)
def dataset(task: str, recordings: tuple[Path, ...]) -> Dataset:
    """Return `recordings` as a task (its name, or what declares it) needs them; forked children share what is read."""
    from tactbench.core.evaluation.dataset import load_dataset

    return load_dataset(task_of(task, installed()), recordings)


Solved = tuple[Row, dict[str, dict[str, Any]]]
"""A row, and by role the columns of the answers: what a child process can send."""


def solve(job: Job, concurrency: int = 1, working: Callable[[str], None] | None = None) -> Solved:
    """Evaluate one cell; raises whatever its plugins and recordings raise.

    Parameters
    ----------
    concurrency
        Cells that may be at work at once while this one is timed.
    working
        Called with what is being done.
    """
    cell, recordings, digests = job
    registry = installed()
    task, estimator = task_of(cell.task_key, registry), registry.estimators[cell.estimator]
    if digests:
        _check_content(recordings, digests)
    folder = Path.cwd()
    try:
        prepare(cell.estimator, task.kind)
    finally:
        os.chdir(folder)  # recordings lie relative to it, wherever a constructor has gone
    import numpy as np

    from tactbench.core.evaluation.cell import CellContext, evaluate_cell
    from tactbench.core.evaluation.result import row_of

    began = time.perf_counter()
    # The global generators get the cell's seed: who draws from them shall not depend on the cells before.
    random.seed(cell.seed)
    np.random.seed(cell.seed % 2**32)  # noqa: NPY002  (it is this old generator that others draw from)
    data = dataset(cell.task_key, recordings)
    context = CellContext(
        task, estimator, dict(cell.params), cell.protocol, cell.split, seed=cell.seed, clock=time.perf_counter,
        progress=working, latency=cell.latency,
    )  # fmt: skip
    result = evaluate_cell(context, data)
    row = {
        **opening(cell, task),
        **row_of(result),
        **_described(data.metas, result.remarks),
        **_published(cell, task, result.split),
        "looks_at": estimator.looks_at,
        "recordings": [str(path) for path in data.paths],
        "status": "done",
        "wall_s": time.perf_counter() - began,
        "concurrency": concurrency,
        "host": this_host(),
        "log": printed(),
    }
    return row, {
        role: {one.name: getattr(sets, one.name) for one in fields(sets)} for role, sets in result.sets.items()
    }


def in_folder(folder: str, concurrency: int, work: Callable[..., Any], item: Any) -> Any:
    """Return `work(item, concurrency=concurrency)`, done in `folder`: relative paths count from the run's.

    For a child process of a Dask worker, which would take a second to import `distributed` with a function beside it.
    """
    os.chdir(folder)
    return work(item, concurrency=concurrency)


def _check_content(recordings: Sequence[Path], digests: Sequence[str]) -> None:
    """Raise EngineError if this process sees other recordings than the run does."""
    from tactbench.core.recording.reader import content_digest

    for path, digest in zip(recordings, digests, strict=True):
        try:
            if content_digest(path) == digest:
                continue
            why = f"its {path} is another file"
        except RecordingError as error:
            why = f"it cannot read {path} ({error.message})"
        raise EngineError(
            f"The worker on {platform.node()} cannot compute this cell: {why}.",
            hint="Every worker must see the files of the run, unchanged, at the same paths.",
        )


FIXED = ("cell", "sensor", "task", "rig", "protocol", "estimator", "params", "is_baseline", "repeat", "repeats", "seed",
         "simulation", "declared_task", "answer_per", "answer_from",
         "metric", "unit", "equivalence", "reference_score")  # fmt: skip
"""What a row says of its cell: evaluating it does not change it."""


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
        "declared_task": cell.declared_task,
        "answer_per": task.answer_per,
        "answer_from": task.answer_from,
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


def unanswered(cell: Cell, why: BaseException) -> Row:
    """Return the row of a cell that was skipped or stopped."""
    error = load_error(dump_error(why))
    registry = installed()
    row = opening(cell, task_of(cell.task_key, registry), simulated=registry.rigs[cell.rig].simulated)
    if isinstance(error, NotApplicable):
        return {**row, "status": "skipped", "reason": str(error)}
    row |= {"status": "failed", "reason": str(error).rstrip(": "), "traceback": error.traceback_text}
    if isinstance(error, CellStopped):
        row |= {"status": error.status, "signal": error.signal, "log": error.log, "wall_s": error.spent_s}
    return row


def _described(metas: Sequence[RecordingMeta], remarks: Sequence[str]) -> Row:
    """Return what recordings say that a reader of the row must know."""
    seconds = [float(meta.provenance["sim_s"]) for meta in metas if "sim_s" in meta.provenance]
    return {
        "simulated": any(meta.simulated for meta in metas),
        "emulated": any(meta.emulation is not None for meta in metas),
        "sim_s": sum(seconds) if seconds else None,
        "assumptions": _assumed(metas),
        "plan": [entry.model_dump() for entry in metas[0].plan],
        "remarks": [*sorted({remark for meta in metas for remark in meta.remarks}), *remarks],
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


def import_estimators(estimators: Iterable[tuple[str, str]]) -> None:
    """Prepare each of our own estimators among `estimators` (name, kind of question), and the libraries of every cell.

    Those of others are imported in their cells' processes only: what an import changes there, such as a library that it
    patches, changes no other cell.
    """
    import_libraries()
    for estimator, kind in sorted(set(estimators)):
        if installed().estimators.owned(estimator).ours:
            prepare(estimator, kind)
