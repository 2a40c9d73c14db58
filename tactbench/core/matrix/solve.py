"""Evaluation of one cell: from a job to its result row."""

from __future__ import annotations

import json
import os
import random
import time
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tactbench.core.errors import CellStopped, EngineError, NotApplicable
from tactbench.core.matrix.keys import Sections
from tactbench.core.matrix.plan import ALIKE, Cell
from tactbench.core.matrix.store import signature
from tactbench.core.plugins.registry import load_object
from tactbench.core.pool.child import plain_error
from tactbench.core.provenance import host_id
from tactbench.core.spec.recording import RecordingMeta, Scalar
from tactbench.core.spec.rig import EstimatorDescriptor
from tactbench.core.spec.row import RowModel
from tactbench.core.spec.task import TaskSpec
from tactbench.core.thread_limit import thread_limit

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset
    from tactbench.core.plugins.interfaces import Estimator
    from tactbench.core.samples import Answers

Row = dict[str, Any]

_TIMES = ("search_s", "fit_s", "predict_s")


class Job(NamedTuple):
    """A cell to be evaluated, with all data needed in the process that evaluates it."""

    cell: Cell
    task: TaskSpec
    estimator: EstimatorDescriptor
    recordings: tuple[Path, ...]
    digests: tuple[str, ...]
    """Content digests of the recordings, in the same order."""
    key: str
    sections: Sections
    """Sections of the key; see `tactbench.core.matrix.keys`."""


def prepare(estimator: EstimatorDescriptor, kind: str) -> None:
    """Import the libraries of an estimator and fit it to a few made-up rows, so that times exclude the first use.

    Errors are ignored, since the estimator's cells will report them.
    """
    if (os.getpid(), estimator.name, kind) in _prepared:
        return
    _prepared.add((os.getpid(), estimator.name, kind))
    with suppress(Exception):
        params = {**estimator.params, **(estimator.rehearsal or {})}
        made = load_object(estimator.where)(kind=kind, seed=0, threads=1, **params)
        if estimator.rehearsal is not None:
            rehearse(made, kind)


_prepared: set[tuple[int, str, str]] = set()
"""Prepared (process, estimator, kind); by process, since memory pages are copied at first use after a fork."""


def rehearse(estimator: Estimator, kind: str) -> None:
    """Fit `estimator` to a few random rows for a task of this kind and predict, with one thread.

    Libraries delay some work (finding other libraries, generating code) until the first fit, where it takes some
    tenths of a second. Processes forked afterwards need not repeat this work.
    """
    import numpy as np

    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, 3))
    y = np.arange(len(X)) % 2 if kind != "regression" else X[:, 0] + rng.normal(size=len(X))
    with warnings.catch_warnings(), np.errstate(all="ignore"), thread_limit(1):
        warnings.simplefilter("ignore")
        estimator.fit(X, y)
        estimator.predict(X)
        estimator.predict(X[:1])


def read_dataset(task: TaskSpec, recordings: tuple[Path, ...], include_incomplete: bool = False) -> Dataset:
    """Return the dataset of a task from `recordings`; the last dataset is kept for the next cell."""
    from tactbench.core.evaluation.dataset import load_dataset

    wanted = [task, recordings, list(map(signature, recordings)), include_incomplete]
    if _last[:4] != wanted:
        _last[:] = [*wanted, load_dataset(task, recordings, include_incomplete=include_incomplete)]
    found: Dataset = _last[4]
    return found


_last: list[Any] = []
"""The last dataset with its origin: [task, recordings, states of the files, `include_incomplete`, dataset]."""


Solved = tuple[Row, "dict[str, Answers]"]
"""Result row of plain data, and the answers by role."""


def solve(job: Job, concurrency: int = 1, own: Mapping[str, Any] | None = None) -> Solved:
    """Evaluate one cell; errors of its plugins and recordings are passed on.

    Parameters
    ----------
    concurrency
        Number of cells that the run evaluates at the same time, for the row.
    own
        Fields of :class:`CellContext` that replace those of the job, for Python callers.
    """
    cell, task, estimator, recordings, *_ = job
    if not own or own["given"] is None:
        folder = Path.cwd()
        try:
            prepare(estimator, task.kind)
        finally:
            os.chdir(folder)  # recordings lie relative to it, wherever a constructor has gone
    import numpy as np

    from tactbench.core.evaluation.cell import CellContext, evaluate_cell

    began = time.perf_counter()
    # The global generators get the cell's seed: their draws do not depend on the cells before.
    random.seed(cell.seed)
    np.random.seed(cell.seed % 2**32)  # noqa: NPY002  (it is this old generator that libraries draw from)
    data = read_dataset(task, recordings, cell.include_incomplete)
    settings: dict[str, Any] = {"split": cell.split, "seed": cell.seed, "latency": cell.timed, **(own or {})}
    context = CellContext(task, estimator, dict(cell.params), cell.protocol, clock=time.perf_counter, **settings)
    result = evaluate_cell(context, data)
    row = {
        **opening(cell, task),
        **result.model_dump(exclude_unset=True),
        **_described(data.metas, result.remarks),
        **published(cell, task, result.split),
        **({} if cell.timed else dict.fromkeys(_TIMES)),
        "looks_at": estimator.looks_at,
        "recordings": [str(path) for path in data.paths],
        "digests": list(job.digests),
        "status": "done",
        "wall_s": time.perf_counter() - began,
        "concurrency": concurrency,
        "host": host_id(),
    }
    json.dumps(row, allow_nan=False)  # a row that is no plain data stops this cell, and not the run that keeps it
    return row, {str(role): answers for role, answers in result.sets.items()}


def check_content(job: Job) -> None:
    """Raise EngineError if the content of a recording differs from that of the run's file at the same path."""
    from tactbench.core.recording.reader import content_digest

    for path, digest in zip(job.recordings, job.digests, strict=True):
        if content_digest(path) != digest:
            raise EngineError(
                f"Host {host_id()} cannot compute this cell: {path} there differs from the run's file.",
                hint="Every worker must see the files of the run, unchanged, at the same paths.",
            )


def opening(cell: Cell, task: TaskSpec, *, simulated: bool = False) -> Row:
    """Return a row with every key of the format, filled with the values known before the evaluation."""
    of_task = ("answer_per", "answer_from", "metric", "unit", "equivalence")
    return {
        **dict(RowModel.model_construct(cell=cell.name, status="skipped")),
        **{name: getattr(cell, name) for name in ALIKE},
        **{name: getattr(task, name) for name in of_task},
        "params": dict(cell.params),
        "is_baseline": cell.baseline,
        "simulation": cell.simulation.model_dump(mode="json", exclude_defaults=True),
        "status": "planned",
        "simulated": simulated,
        **published(cell, task, cell.split),
    }


def published(cell: Cell, task: TaskSpec, split: str | None) -> Row:
    """Return a row's keys on the published score to compare the cell with; empty if none or if `params` are changed."""
    found = task.published_for(cell.sensor, cell.protocol, cell.estimator, split)
    if found is None or (cell.baseline if found.estimator is None else cell.params):
        return {"published": None, "published_reference": "", "published_remark": ""}
    own = "" if found.estimator else "another model than ours"
    remark = "; ".join(part for part in (own, found.remark) if part)
    return {"published": found.score, "published_reference": found.reference, "published_remark": remark}


def unanswered(cell: Cell, task: TaskSpec, why: BaseException, *, simulated: bool) -> Row:
    """Return the row of a cell that was skipped or stopped because of the error `why`."""
    error = plain_error(why)
    row = {**opening(cell, task, simulated=simulated), "host": host_id()}
    if isinstance(error, NotApplicable):
        return {**row, "status": "skipped", "reason": str(error)}
    row |= {"status": "failed", "reason": str(error).rstrip(": "), "traceback": error.traceback_text}
    if isinstance(error, CellStopped):
        row |= {"status": error.status, "signal": error.signal, "log": error.log, "wall_s": error.spent_s}
    return row


def _described(metas: Sequence[RecordingMeta], remarks: Sequence[str]) -> Row:
    """Return the keys of a result row that describe its recordings."""
    seconds = [float(meta.provenance["sim_s"]) for meta in metas if "sim_s" in meta.provenance]
    return {
        "simulated": any(meta.simulated for meta in metas),
        "emulated": any(meta.emulation is not None for meta in metas),
        "sim_s": sum(seconds) if seconds else None,
        "assumptions": _assumed(metas),
        "plan": [entry.model_dump(mode="json") for entry in metas[0].plan],
        "remarks": [*sorted({remark for meta in metas for remark in meta.remarks}), *remarks],
    }


def _assumed(metas: Sequence[RecordingMeta]) -> dict[str, Scalar]:
    """Return the assumptions of simulated recordings by name; differing values as a range or a list."""
    found: dict[str, Scalar] = {}
    for name in dict.fromkeys(name for meta in metas for name in meta.assumptions):
        values: list[Any] = list(dict.fromkeys(meta.assumptions[name] for meta in metas if name in meta.assumptions))
        if len(values) == 1:
            found[name] = values[0]
        elif all(isinstance(value, int | float) for value in values):
            found[name] = f"{min(values):g} to {max(values):g}"
        else:
            found[name] = ", ".join(map(str, values))
    return found
