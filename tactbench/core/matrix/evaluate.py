"""Answering the cells: those that are finished are found again, the others go to an engine."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from tactbench.core.errors import PluginContractError
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.evaluate_cell import Answer, Job, opening, reused, solve, this_host, unanswered
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import RecordingPlan
from tactbench.core.matrix.progress import Progress
from tactbench.core.matrix.recorded import read_all, read_digest
from tactbench.core.matrix.store import NotPlainError, Row, Store
from tactbench.core.matrix.why import Book, beside
from tactbench.core.plugins.registry import installed
from tactbench.core.samples import Answers
from tactbench.core.spec.status import STOPPED


@dataclass
class Evaluated:
    """The rows so far."""

    rows: dict[str, Row] = field(default_factory=dict)
    """By name of the cell."""
    computed: int = 0
    """Cells computed now; the others were found finished."""


def evaluate_all(
    cells: Sequence[Cell],
    material: RecordingPlan,
    book: Book,
    choice: EngineChoice,
    store: Store,
    made_by: str,
    told: Progress,
) -> Evaluated:
    """Give every cell its row: found in `store`, computed now, or saying why it could not be.

    `made_by` is the id of this run's provenance.
    """
    done = Evaluated()
    known = _Known({}, material, store.folder, made_by)
    waiting: list[Job] = []
    unreadable = _unreadable(cells, material, choice)
    for cell in cells:
        paths = material.paths(cell)
        trouble = material.trouble(cell)
        if unreadable and trouble is None:
            trouble = next((unreadable[path] for path in paths if path in unreadable), None)
        if trouble is None:
            try:
                known.keys[cell.name] = book.keys.of_cell(cell, [material.recorded.digest(path) for path in paths])
            except Exception as error:
                trouble = error
        found = store.finished(known.keys[cell.name]) if trouble is None else None
        if found is not None and found["status"] == "done":
            done.rows[cell.name] = reused(found, cell, installed().tasks[cell.task].spec)
            store.reuse(done.rows[cell.name])
        else:
            remote = choice.name == "dask" and trouble is None
            digests = tuple(material.recorded.digest(path) for path in paths) if remote else ()
            waiting.append(Job(cell, tuple(paths), digests, trouble))
    done.computed = len(waiting)
    if waiting:
        keyed = ((one.cell, known.keys[one.cell.name], one.recordings) for one in waiting if one.trouble is None)
        book.note_cells(keyed, material.recorded, store.folder)
        _compute(waiting, known, choice, store, told, done)
        overwritten = [job for job in waiting if _overwritten(done.rows[job.cell.name], store)]
        if overwritten:
            _compute(overwritten, known, choice, store, told, done)
    return done


def _overwritten(row: Row, store: Store) -> bool:
    """Return whether a cell was finished and its shard is not what was written: a later cell has laid hands on it."""
    return row["status"] == "done" and store.finished(row["key"]) is None


@dataclass(frozen=True)
class _Known:
    """What rows say that the run knows, and their cells do not."""

    keys: dict[str, str]
    """By name of the cell."""
    material: RecordingPlan
    folder: Path
    made_by: str
    read: dict[tuple[str, ...], Row] = field(default_factory=dict)
    """What rows say of the same recordings."""

    def told(self, row: Row) -> Row:
        """Return `row` with all of it."""
        named = tuple(row["recordings"])
        if named not in self.read:
            paths = [Path(path) for path in named]
            digests = [self.material.recorded.digest(path) for path in paths]
            self.read[named] = {"digests": digests, "recordings": [beside(path, self.folder) for path in paths]}
        known = {"key": self.keys.get(row["cell"], ""), "made_by": self.made_by, "host": row["host"] or this_host()}
        return {**row, **self.read[named], **known}


def _unreadable(cells: Sequence[Cell], material: RecordingPlan, choice: EngineChoice) -> dict[Path, BaseException]:
    """Have the digest of every recording at hand; return why some have none."""
    wanted = {path: None for cell in cells if material.trouble(cell) is None for path in material.paths(cell)}
    return read_all(read_digest, material.recorded.unread(wanted, "digest"), material.recorded, choice)


def _compute(
    waiting: list[Job], known: _Known, choice: EngineChoice, store: Store, told: Progress, done: Evaluated
) -> None:
    jobs = [job for job in waiting if job.trouble is None]
    here = choice.here(len(jobs))
    told.begin("evaluating", len(waiting), alone=here)
    work = partial(solve, concurrency=choice.concurrency(len(jobs)), working=told.working if here else None)
    engine = choice.engine(len(jobs))
    without_recordings: Iterator[tuple[Job, Any]] = (
        (job, (unanswered(job.cell, job.trouble), {})) for job in waiting if job.trouble is not None
    )
    with closing(_each(without_recordings, engine.each(work, _ordered(jobs, choice)))) as outcomes:
        for job, outcome in outcomes:
            _entered(job.cell, outcome, known, store, told, done)


def _entered(cell: Cell, outcome: Any, known: _Known, store: Store, told: Progress, done: Evaluated) -> None:
    """Keep what came of a cell."""
    try:
        row = _written(_judged(cell, outcome, known), known, store)
    except NotPlainError as error:
        row = _written(_refused(cell, f"its row is not plain data: {error}"), known, store)
    done.rows[cell.name] = row
    told.advance(cell.name, stopped=row["status"] in STOPPED)


def _written(outcome: Answer, known: _Known, store: Store) -> Row:
    """Write a row, and return it as the store will give it back."""
    row, sets = outcome
    told = known.told(row)
    return store.keep(told["key"], told, sets) if told["status"] == "done" else store.note(told)


def _each(*several: Iterable[tuple[Job, Any]]) -> Generator[tuple[Job, Any], None, None]:
    for some in several:
        yield from some


def _ordered(jobs: list[Job], choice: EngineChoice) -> Iterable[Job]:
    """Return `jobs` so that those with the same recordings come together; forked cells then share what was read."""
    from tactbench.core.matrix.evaluate_cell import import_estimators, shared

    groups: dict[tuple[str, tuple[Path, ...]], list[Job]] = {}
    for job in jobs:
        groups.setdefault((job.cell.task, job.recordings), []).append(job)
    if choice.forks(len(jobs)):
        return shared(groups, choice.pool(1))
    if choice.here(len(jobs)):
        import_estimators([job.cell for job in jobs])
    return [job for group in groups.values() for job in group]


def _judged(cell: Cell, outcome: Any, known: _Known) -> Answer:
    """Return the row and answers of a cell; what stopped it, or what is wrong with them, makes the row."""
    from tactbench.core.matrix.checking import fault_in

    if isinstance(outcome, BaseException):
        return unanswered(cell, outcome), {}
    fault = fault_in(outcome, opening(cell, installed().tasks[cell.task].spec))
    if fault:
        return _refused(cell, fault)
    row, columns = outcome
    return row, {role: Answers(**columns[role]) for role in columns}


def _refused(cell: Cell, fault: str) -> Answer:
    error = PluginContractError(f"The cell's result is not one: {fault}.", hint="Its estimator or task is at fault.")
    return unanswered(cell, error), {}
