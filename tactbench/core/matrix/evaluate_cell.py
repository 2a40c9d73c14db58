"""One cell: carried out in whatever process an engine has chosen for it, to one row, whatever happens in it."""

from __future__ import annotations

import os
import platform
import random
import time
import traceback
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tactbench.core.errors import CellStopped, EngineError, NotApplicable, RecordingError, TactbenchError
from tactbench.core.evaluation.libraries import import_libraries
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.store import Row
from tactbench.core.plugins.registry import Registry, installed, load_object
from tactbench.core.pool.log import printed
from tactbench.core.pool.pool import Pool
from tactbench.core.provenance.gather import host_id
from tactbench.core.samples import Answers
from tactbench.core.spec.recording import RecordingMeta, Scalar
from tactbench.core.spec.row import RowModel
from tactbench.core.spec.scene import Role
from tactbench.core.spec.task import TaskSpec

if TYPE_CHECKING:
    from tactbench.core.evaluation.cell import CellResult
    from tactbench.core.evaluation.dataset import Dataset

PRELOAD = ("tactbench.core.matrix.preloaded",)
"""Imported by the fork server of processes that cannot fork themselves."""


class Job(NamedTuple):
    """A cell to be answered."""

    cell: Cell
    recordings: tuple[Path, ...]
    digests: tuple[str, ...] = ()
    """Of the recordings' content, which a process on another machine compares with what it sees; none: it need not."""
    trouble: BaseException | None = None
    """Why there are no recordings."""


Wanted = tuple[str, tuple[Path, ...]]
"""A task and recordings."""

this_host = lru_cache(maxsize=1)(host_id)


def prepare(estimator: str, kind: str) -> None:
    """Import what an estimator needs, and have it learn a few made-up rows, before any clock is read.

    Done once in a process; a child process does it again, since a fork copies each page of memory when it is first
    written to. Raises whatever the estimator raises.
    """
    here = os.getpid(), estimator, kind
    if here in _prepared:
        return
    _prepared.add(here)
    descriptor = installed().estimators[estimator]
    build = load_object(descriptor.where)
    build(kind=kind, seed=0, threads=1, **descriptor.params)
    if descriptor.rehearsal is not None:
        from tactbench.core.evaluation.rehearsal import rehearse

        rehearse(build(kind=kind, seed=0, threads=1, **{**descriptor.params, **descriptor.rehearsal}), kind)


_prepared: set[tuple[int, str, str]] = set()
"""By process, estimator and kind of question."""


class Datasets:
    """Recordings as a task needs them, the last used of them kept: forked children share what is here.

    Parameters
    ----------
    most
        So many are kept.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._kept: OrderedDict[Wanted, Dataset] = OrderedDict()

    def __contains__(self, wanted: Wanted) -> bool:
        return wanted in self._kept

    def __call__(self, task: str, recordings: tuple[Path, ...]) -> Dataset:
        """Return `recordings` as `task` needs them; raises as `load_dataset` does."""
        from tactbench.core.evaluation.dataset import load_dataset

        wanted = (task, recordings)
        if wanted not in self._kept:
            self._kept[wanted] = load_dataset(installed().tasks[task].spec, recordings)
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        self._kept.move_to_end(wanted)
        return self._kept[wanted]


DATASETS = Datasets(2)
"""Those of this process."""


Solved = tuple[Row, dict[str, dict[str, Any]]]
"""A row, and by role the columns of the answers: what a child process can send."""


def solve(job: Job, concurrency: int = 1, working: Callable[[str], None] | None = None) -> Solved:
    """Answer one cell.

    An exception of a plugin or a recording becomes a row. What is more than an exception, such as SystemExit, and a
    MemoryError are left to the engine that called.

    Parameters
    ----------
    concurrency
        Cells that may be at work at once while this one is timed.
    """
    cell, recordings, digests, trouble = job
    registry = installed()
    trouble = trouble or _unseen(recordings, digests)
    if trouble is not None:
        return unanswered(cell, trouble), {}
    folder = Path.cwd()
    try:
        prepare(cell.estimator, registry.tasks[cell.task].spec.kind)
    except MemoryError:
        raise
    except Exception:
        pass  # the cell will tell
    finally:
        os.chdir(folder)  # recordings lie relative to it, wherever a constructor has gone
    began = time.perf_counter()
    _seed_everything(cell.seed)
    row, sets = answer(cell, registry, recordings, DATASETS, working)
    timed = {"wall_s": time.perf_counter() - began, "concurrency": concurrency, "host": this_host()}
    columns = {
        str(role): {one.name: getattr(answers, one.name) for one in fields(answers)} for role, answers in sets.items()
    }
    return {**row, **timed, "log": printed()}, columns


def _unseen(recordings: tuple[Path, ...], digests: tuple[str, ...]) -> BaseException | None:
    """Return what is wrong if this process sees other recordings than the run does."""
    from tactbench.core.recording.reader import content_digest

    for path, digest in zip(recordings, digests, strict=False):
        try:
            if content_digest(path) == digest:
                continue
            why = f"its {path} is another file"
        except RecordingError as error:
            why = f"it cannot read {path} ({error.message})"
        return EngineError(
            f"The worker on {platform.node()} cannot compute this cell: {why}.",
            hint="Every worker must see the files of the run, unchanged, at the same paths.",
        )
    return None


def unanswered(cell: Cell, trouble: BaseException) -> dict[str, object]:
    """Return the row of a cell that could not be carried out, or not to its end."""
    registry = installed()
    row = opening(cell, registry.tasks[cell.task].spec, simulated=registry.rigs[cell.rig].simulated)
    if isinstance(trouble, NotApplicable):
        return {**row, "status": "skipped", "reason": str(trouble)}
    return stopped(row, trouble)


def _seed_everything(seed: int) -> None:
    """Give the global generators the cell's seed: who draws from them shall not depend on the cells before."""
    import numpy as np

    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002  (it is this old generator that others draw from)


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
    from tactbench.core.evaluation.cell import CellContext, evaluate

    task = registry.tasks[cell.task].spec
    row = opening(cell, task, simulated=registry.rigs[cell.rig].simulated)
    try:
        material = dataset(task.name, tuple(recordings))
        result = evaluate(
            CellContext(
                task,
                registry.estimators[cell.estimator],
                dict(cell.params),
                cell.protocol,
                cell.split,
                seed=cell.seed,
                clock=time.perf_counter,
                threads=1,
                progress=working,
                latency=cell.latency,
            ),
            material,
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


Groups = Mapping[Wanted, Sequence[Job]]
"""Cells by task and recordings."""


def shared(groups: Groups, pool: Pool) -> Iterator[Job]:
    """Yield the cells group by group; before each group, load here what several of its cells need."""
    from tactbench.core.thread_limit import find_libraries

    for (task, recordings), jobs in groups.items():
        import_estimators([job.cell for job in jobs])
        trouble = _read_here(task, recordings, pool) if len(jobs) > 1 else None
        find_libraries()
        for job in jobs:
            yield job._replace(trouble=trouble)


def _read_here(task: str, recordings: tuple[Path, ...], pool: Pool) -> BaseException | None:
    """Have recordings in memory; return what is wrong with them.

    They are read by a child process first: only what that survives is read here as well.
    """
    if (task, recordings) in DATASETS:
        return None
    ((_, outcome),) = pool.each(_readable, [(task, recordings)])
    if isinstance(outcome, BaseException):
        return outcome
    DATASETS(task, recordings)
    return None


def _readable(wanted: Wanted) -> bool:
    DATASETS(*wanted)
    return True


def import_estimators(cells: Sequence[Cell]) -> None:
    """Prepare each of our own estimators that `cells` use, once; what is wrong with it is its cells'.

    Those of others are imported in their cells' processes only: what an import changes there, such as a library that it
    patches, changes no other cell.
    """
    _import({(cell.estimator, installed().tasks[cell.task].spec.kind) for cell in cells})


def import_ours() -> None:
    """Prepare all of our own estimators."""
    _import({(one.name, kind) for one in installed().estimators for kind in one.kinds})


def _import(several: Set[tuple[str, str]]) -> None:
    from tactbench.core.thread_limit import find_libraries

    import_libraries()
    for estimator, kind in sorted(several - _tried):
        _tried.add((estimator, kind))
        if installed().estimators.owned(estimator).ours:
            with suppress(Exception):
                prepare(estimator, kind)
    find_libraries()


_tried: set[tuple[str, str]] = set()
