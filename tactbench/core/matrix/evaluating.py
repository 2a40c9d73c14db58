"""Answering the cells: those that are finished are found again, the others go to an engine."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import PluginContractError
from tactbench.core.matrix.answer import Answer, opening, reused
from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.explanation import Book, beside
from tactbench.core.matrix.in_flight import InFlight
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.planning import Material
from tactbench.core.matrix.progress import Progress
from tactbench.core.matrix.reading import read_all
from tactbench.core.matrix.recorded import read_digest
from tactbench.core.matrix.store import NotPlainError, Row, Store
from tactbench.core.plugins.registry import installed
from tactbench.core.samples import Answers
from tactbench.core.spec.status import STOPPED

if TYPE_CHECKING:
    from tactbench.core.matrix.solving import Job


@dataclass
class Evaluated:
    """The rows so far."""

    rows: dict[str, Row] = field(default_factory=dict)
    """By name of the cell."""
    computed: int = 0
    """Cells computed now; the others were found finished."""


def evaluate_all(
    cells: Sequence[Cell],
    material: Material,
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
            waiting.append((cell, tuple(paths), trouble))
    done.computed = len(waiting)
    if waiting:
        keyed = ((cell, known.keys[cell.name], paths) for cell, paths, _ in waiting if cell.name in known.keys)
        book.note_cells(keyed, material.recorded, store.folder)
        _compute(waiting, known, choice, store, told, done)
        spoilt = [job for job in waiting if _spoilt(done.rows[job[0].name], store)]
        if spoilt:
            _compute(spoilt, known, choice, store, told, done)
    return done


def _spoilt(row: Row, store: Store) -> bool:
    """Return whether a cell was finished and its shard is not what was written: a later cell has laid hands on it."""
    return row["status"] == "done" and store.finished(row["key"]) is None


@dataclass(frozen=True)
class _Known:
    """What rows say that the run knows, and their cells do not."""

    keys: dict[str, str]
    """By name of the cell."""
    material: Material
    folder: Path
    made_by: str
    read: dict[tuple[str, ...], Row] = field(default_factory=dict)
    """What rows say of the same recordings."""
    opened: set[str] = field(default_factory=set)
    """The keys that every row has, once the first was looked at."""

    def keys_of_rows(self, cell: Cell) -> set[str]:
        """Return the keys that the row of `cell` must have, and that of any other."""
        if not self.opened:
            self.opened.update(opening(cell, installed().tasks[cell.task].spec))
        return self.opened

    def told(self, row: Row) -> Row:
        """Return `row` with all of it."""
        from tactbench.core.matrix.solving import this_host

        named = tuple(row["recordings"])
        if named not in self.read:
            paths = [Path(path) for path in named]
            digests = [self.material.recorded.digest(path) for path in paths]
            self.read[named] = {"digests": digests, "recordings": [beside(path, self.folder) for path in paths]}
        known = {"key": self.keys.get(row["cell"], ""), "made_by": self.made_by, "host": row["host"] or this_host()}
        return {**row, **self.read[named], **known}


def _unreadable(cells: Sequence[Cell], material: Material, choice: EngineChoice) -> dict[Path, BaseException]:
    """Have the digest of every recording at hand; return why some have none."""
    wanted = {path: None for cell in cells if material.trouble(cell) is None for path in material.paths(cell)}
    return read_all(read_digest, material.recorded.unread(wanted, "digest"), material.recorded, choice)


def _compute(
    waiting: list[Job], known: _Known, choice: EngineChoice, store: Store, told: Progress, done: Evaluated
) -> None:
    from tactbench.core.matrix.solving import solve, unanswered

    jobs = [job for job in waiting if job[2] is None]
    marks = InFlight(store.folder)
    if len(jobs) == 1 and choice.here(1) and marks.ended_a_run(known.keys[jobs[0][0].name]):
        choice = EngineChoice("isolated", 1, choice.limits)
    here = choice.here(len(jobs))
    told.begin("evaluating", len(waiting), alone=here)
    work = partial(solve, concurrency=choice.concurrency(len(jobs)), working=told.working if here else None)
    engine = choice.engine(len(jobs))
    hopeless: Iterator[tuple[Job, Any]] = (
        (job, (unanswered(job[0], job[2]), {})) for job in waiting if job[2] is not None
    )
    ordered = _ordered(jobs, choice)
    computed = engine.each(work, _marked(ordered, marks, known.keys) if here else ordered)
    try:
        with closing(_each(hopeless, computed)) as outcomes:
            for job, outcome in outcomes:
                _entered(job[0], outcome, known, store, told, done)
    finally:
        marks.clear()


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
    from tactbench.core.matrix.preloading import import_estimators, shared

    groups: dict[tuple[str, tuple[Path, ...]], list[Job]] = {}
    for job in jobs:
        groups.setdefault((job[0].task, job[1]), []).append(job)
    if choice.forks(len(jobs)):
        return shared(groups, choice)
    if choice.here(len(jobs)):
        import_estimators([job[0] for job in jobs])
    return [job for group in groups.values() for job in group]


def _marked(jobs: Iterable[Job], marks: InFlight, keys: Mapping[str, str]) -> Iterator[Job]:
    """Yield `jobs`, and note each before it begins: one that ends this process is known to the next."""
    for job in jobs:
        marks.set(keys[job[0].name])
        yield job


def _judged(cell: Cell, outcome: Any, known: _Known) -> Answer:
    """Return the row and answers of a cell; what stopped it, or what is wrong with them, makes the row."""
    from tactbench.core.matrix.checking import fault_in
    from tactbench.core.matrix.solving import unanswered

    if isinstance(outcome, BaseException):
        return unanswered(cell, outcome), {}
    fault = fault_in(outcome, cell.name, known.keys_of_rows(cell))
    if fault:
        return _refused(cell, fault)
    row, columns = outcome
    return row, {role: Answers(**columns[role]) for role in columns}


def _refused(cell: Cell, fault: str) -> Answer:
    from tactbench.core.matrix.solving import unanswered

    error = PluginContractError(f"The cell's result is not one: {fault}.", hint="Its estimator or task is at fault.")
    return unanswered(cell, error), {}
