"""Evaluating the cells: those that are finished are found in the store, the others go to an engine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import PluginContractError
from tactbench.core.matrix.context import RunContext
from tactbench.core.matrix.evaluate_cell import (
    Job,
    dataset,
    import_estimators,
    opening,
    reused,
    solve,
    this_host,
    unanswered,
)
from tactbench.core.matrix.plan import Cell, task_of
from tactbench.core.matrix.plan_recordings import request_key
from tactbench.core.matrix.recorded import read_all, read_digest
from tactbench.core.matrix.store import NotPlainError, Row
from tactbench.core.matrix.why import beside, cell_entries
from tactbench.core.plugins.registry import installed
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool
from tactbench.core.pool.processes import can_fork
from tactbench.core.samples import Answers
from tactbench.core.spec.status import STOPPED
from tactbench.core.thread_limit import find_libraries

if TYPE_CHECKING:
    from tactbench.core.matrix.dask import Dask


def evaluate_all(run: RunContext, cells: Sequence[Cell], stage: str) -> tuple[list[Row], int]:
    """Give every cell its row: found in the store, computed now, or saying why it could not be.

    Returns
    -------
    rows, computed
        In the order of the cells; how many were not found finished.
    """
    store, recorded, choice, progress = run.store, run.recorded, run.choice, run.progress
    paths, troubles = run.recording_plan.paths, run.recording_plan.troubles
    rows: dict[str, Row] = {}
    key_of: dict[str, str] = {}
    jobs: list[Job] = []
    stopped: list[tuple[Cell, BaseException]] = []
    """Cells without their recordings."""
    needed = {path: None for need in map(request_key, cells) if need not in troubles for path in paths[need]}
    unreadable = read_all(read_digest, "digest", needed, recorded, choice.limits)
    for cell in cells:
        need = request_key(cell)
        trouble = troubles.get(need) or next((unreadable[path] for path in paths[need] if path in unreadable), None)
        if trouble is None:
            try:
                digests = tuple(recorded.digest(path) for path in paths[need])
                key_of[cell.name] = run.keys.of_cell(cell, digests)
            except Exception as error:
                trouble = error
        if trouble is not None:
            stopped.append((cell, trouble))
            continue
        found = store.finished(key_of[cell.name])
        if found is not None:
            rows[cell.name] = reused(found, cell, task_of(cell.task_key, installed()))
            store.reuse(rows[cell.name])
        else:
            jobs.append(Job(cell, tuple(paths[need]), digests if choice.name == "dask" else ()))
    computed = len(jobs) + len(stopped)
    engine = choice.engine(len(jobs))
    if computed:
        progress.begin(stage, computed, alone=isinstance(engine, InProcess))
    keyed = ((job.cell, key_of[job.cell.name], job.recordings) for job in jobs)
    run.book.write(cell_entries(keyed, run.keys, recorded, store.folder))
    for cell, trouble in stopped:
        rows[cell.name] = _kept(run, cell, trouble, "")
        progress.advance(cell.name, stopped=rows[cell.name]["status"] in STOPPED)
    for _ in range(2):  # a cell may have written over the shard of an earlier one, which is then computed again
        engine = choice.engine(len(jobs))
        working = progress.working if isinstance(engine, InProcess) else None
        work = partial(solve, concurrency=max(1, min(choice.jobs, len(jobs))), working=working)
        batches = _batches(jobs, engine, choice.limits)
        # In process, those of one estimator share a process: what its import changes there, it changes for itself.
        for batch in batches if choice.name == "in-process" else [chain.from_iterable(batches)]:
            with closing(engine.each(work, batch)) as outcomes:
                for job, outcome in outcomes:
                    rows[job.cell.name] = _kept(run, job.cell, outcome, key_of[job.cell.name])
                    progress.advance(job.cell.name, stopped=rows[job.cell.name]["status"] in STOPPED)
        done = [job for job in jobs if rows[job.cell.name]["status"] == "done"]
        jobs = [job for job in done if store.finished(key_of[job.cell.name]) is None]
        if not jobs:
            break
    return [rows[cell.name] for cell in cells], computed


def _kept(run: RunContext, cell: Cell, outcome: Any, key: str) -> Row:
    """Write the row of a cell, and return it as the store will give it back.

    What stopped the cell, or what is wrong with its result, makes the row.
    """
    from tactbench.core.matrix.checking import fault_in

    store = run.store
    known = {"key": key, "made_by": run.made_by, "host": this_host()}  # what the run knows, and its cells do not
    if isinstance(outcome, BaseException):
        return store.note({**unanswered(cell, outcome), **known})
    fault = fault_in(outcome, opening(cell, task_of(cell.task_key, installed())))
    if not fault:
        row, columns = outcome
        paths = [Path(path) for path in row["recordings"]]
        row |= {**known, "host": row["host"] or known["host"]}
        row["digests"] = [run.recorded.digest(path) for path in paths]
        row["recordings"] = [beside(path, store.folder) for path in paths]
        try:
            return store.keep(row["key"], row, {role: Answers(**columns[role]) for role in columns})
        except NotPlainError as error:
            fault = f"its row is not plain data: {error}"
    refused = PluginContractError(f"The cell's result is not one: {fault}.", hint="Its estimator or task is at fault.")
    return store.note({**unanswered(cell, refused), **known})


def _batches(jobs: Sequence[Job], engine: Pool | InProcess | Dask, limits: Limits) -> Iterator[list[Job]]:
    """Yield `jobs` group by group of one task and the same recordings, those of one estimator together.

    Before each group, what cells share that are forked off this process is imported and read here. A child process
    reads it first: what stops that is not read here, and stops each of the cells in its own process.
    """
    groups: dict[tuple[str, tuple[Path, ...]], list[Job]] = {}
    for job in jobs:
        groups.setdefault((job.cell.task_key, job.recordings), []).append(job)
    forks = isinstance(engine, Pool) and can_fork()
    for (task, recordings), members in groups.items():
        if forks or isinstance(engine, InProcess):
            kinds = ((job.cell.estimator, task_of(task, installed()).kind) for job in members)
            import_estimators(kinds)
        if forks and len(members) > 1:
            ((_, readable),) = Pool(1, limits, reuse=True).each(_is_readable, [(task, recordings)])
            if readable is True:
                dataset(task, recordings)
        find_libraries()
        by_estimator: dict[str, list[Job]] = {}
        for job in members:
            by_estimator.setdefault(job.cell.estimator, []).append(job)
        yield from by_estimator.values()


def _is_readable(task_and_recordings: tuple[str, tuple[Path, ...]]) -> bool:
    dataset(*task_and_recordings)
    return True
