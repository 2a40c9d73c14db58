"""A run: plan, acquire, evaluate, store; then the rows, in the order of the plan."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tactbench.core.errors import NotApplicable
from tactbench.core.matrix.execution import InProcess, Job, Workers, prepare, record, solve, workers
from tactbench.core.matrix.explanation import beside, cell_entry, recording_entry
from tactbench.core.matrix.key_book import KeyBook
from tactbench.core.matrix.keys import Keys, keys_of
from tactbench.core.matrix.material import Order
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.planned import Needed, planned
from tactbench.core.matrix.progress import Progress, Silence
from tactbench.core.matrix.provenance import gather
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.status import STOPPED

SEED_DECIDES = (
    "cell", "status", "metric", "score", "ci_low", "ci_high", "ci_method", "n_recordings", "n_train", "n_test",
    "counts", "chosen", "scores", "confusion", "classes", "split", "stamps", "dagger",
)  # fmt: skip
"""Keys of a row that do not depend on machine or hour: ``scores.json`` holds these."""


@dataclass(frozen=True)
class Outcome:
    """What a run leaves behind."""

    rows: tuple[Row, ...]
    provenance: dict[str, Any]
    computed: int
    """Cells computed now; the others were found finished."""
    recorded: int
    """Recordings made now."""
    recordings: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    """The files each cell was answered from, by its name."""

    @property
    def failures(self) -> list[Row]:
        """The rows of cells that should have ended otherwise."""
        return [row for row in self.rows if row["status"] in STOPPED]


def run_matrix(
    matrix: MatrixSpec,
    store: Store,
    *,
    jobs: int = 1,
    recordings: Path | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Carry out `matrix` and write the files of a run: ``run.json``, ``scores.json`` and ``unfinished.json``.

    The parameters are those of `carry_out`.
    """
    outcome = carry_out(matrix, store, jobs=jobs, recordings=recordings, progress=progress)
    store.write("run.json", json.dumps(outcome.provenance, indent=1, sort_keys=True) + "\n")
    store.write("scores.json", scores_text(outcome.rows))
    unfinished = [row for row in outcome.rows if row["status"] != "done"]
    store.write("unfinished.json", json.dumps(unfinished, indent=1, sort_keys=True) + "\n")
    return outcome


def carry_out(
    matrix: MatrixSpec,
    store: Store,
    *,
    jobs: int = 1,
    recordings: Path | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Acquire and answer `matrix`, reusing what `store` already has; the files of the last run stay as they are.

    Parameters
    ----------
    matrix
        What to run.
    store
        Where results lie.
    jobs
        Processes at work; results do not depend on it, times may.
    recordings
        Folder for rigs that replay.
    progress
        Told what happens.

    Raises
    ------
    UsageError
        If the matrix asks for something that is not there. Nothing has been run then.
    """
    told = progress or Silence()
    registry = installed()
    sources = SourceDigests(store.folder / "cache" / "sources.json")
    recorded = Recorded(store.folder / "cache" / "recordings.json")
    book = KeyBook(store.folder / "cache" / "keys")
    cells, material = planned(matrix, registry, sources, store, recordings, recorded)
    keys = keys_of(registry, sources)
    troubles = _acquire(cells, material, keys, book, jobs, told)
    with workers(jobs) as crew:
        rows, computed = _evaluate(cells, material, troubles, crew, jobs, keys, book, store, told)
    fill_baselines(rows)
    provenance = gather(sources, seed=matrix.seed, jobs=jobs)
    sources.save()
    recorded.save()
    used = {cell.name: tuple(material.paths(cell)) for cell in cells}
    return Outcome(tuple(rows), provenance, computed, recorded.number_made, used)


def _acquire(
    cells: Sequence[Cell], material: Needed, keys: Keys, book: KeyBook, jobs: int, told: Progress
) -> dict[Path, BaseException]:
    """Make the recordings that are missing; return what went wrong, by path.

    Simulations do not disturb each other and are not timed by the wall: they use all cores, and the estimators' heavy
    libraries are imported meanwhile. The first one is done here, so that forked workers inherit what it has loaded and
    prepared. A real rig does one scene at a time.
    """
    unique = {order.path: order for orders in material.orders.values() for order in orders}
    missing = [order for path, order in unique.items() if not path.exists()]
    troubles: dict[Path, BaseException] = {}
    if not missing:
        return troubles
    book.write(recording_entry(order, keys) for order in missing)
    simulated = all(installed().rigs[order.rig].simulated for order in missing)
    hands = max(jobs, os.cpu_count() or 1) if simulated else 1
    told.begin("recording", len(missing), alone=hands == 1)

    def note(order: Order, outcome: str | BaseException) -> None:
        if isinstance(outcome, BaseException):
            troubles[order.path] = outcome
        else:
            material.recorded.made(order.path, outcome)
        told.advance(f"{order.sensor} {order.scene.name}")

    try:
        for order, outcome in InProcess().each(record, missing[:1]):
            note(order, outcome)
        if missing[1:]:
            with workers(min(hands, len(missing) - 1)) as crew:
                for order, outcome in crew.each(record, missing[1:], meanwhile=lambda: _import_estimators(cells)):
                    note(order, outcome)
    except BaseException:
        from tactbench.core.recording.format import partial_path

        # Workers that were ended in the middle could not tidy up behind themselves.
        for order in missing:
            partial_path(order.path).unlink(missing_ok=True)
        raise
    return troubles


def _import_estimators(cells: Sequence[Cell]) -> None:
    for cell in cells:
        prepare(cell)


def _evaluate(
    cells: Sequence[Cell],
    material: Needed,
    troubles: dict[Path, BaseException],
    crew: Workers,
    jobs: int,
    keys: Keys,
    book: KeyBook,
    store: Store,
    told: Progress,
) -> tuple[list[Row], int]:
    digest = material.recorded.digest
    rows: dict[str, Row] = {}
    found: dict[str, str] = {}
    waiting: list[Job] = []
    for cell in cells:
        paths = material.paths(cell)
        trouble = next((troubles[path] for path in paths if path in troubles), None)
        if not paths:
            trouble = NotApplicable(
                f"Task {cell.task!r} has no scenes for rig {cell.rig!r}, and there are no recordings of it.",
                hint="Use --rig replay --recordings DIR.",
            )
        if trouble is None:
            try:
                found[cell.name] = keys.of_cell(cell, [digest(path) for path in paths])
            except Exception as error:
                trouble = error
        known = store.finished(found[cell.name]) if trouble is None else None
        if known is not None and known["status"] == "done":
            rows[cell.name] = {**known, "cell": cell.name, "repeat": cell.repeat, "repeats": cell.repeats}
        else:
            waiting.append((cell, tuple(paths), trouble))
    if waiting:
        book.write(
            cell_entry(cell, found[cell.name], keys, paths, material.recorded, store.folder)
            for cell, paths, _ in waiting
            if cell.name in found
        )
        told.begin("evaluating", len(waiting), alone=jobs == 1)
        work: Callable[[Job], Any] = solve if jobs > 1 else (lambda job: solve(job, told.working))
        for (cell, _, trouble), outcome in crew.each(work, waiting):
            row, sets = outcome if not isinstance(outcome, BaseException) else solve((cell, (), outcome))
            row["key"] = found.get(cell.name, "")
            row["recordings"] = [beside(Path(path), store.folder) for path in row["recordings"]]
            if row["status"] == "done" and trouble is None:
                store.keep(row["key"], row, sets)
            rows[cell.name] = row
            told.advance(cell.name)
    return [rows[cell.name] for cell in cells], len(waiting)


def fill_baselines(rows: Sequence[Row]) -> None:
    """Write the score of the first baseline of each group beside every row of the group."""
    by_group: dict[tuple[Any, ...], float] = {}
    for row in rows:
        if row["is_baseline"] and row["status"] == "done":
            by_group.setdefault(_group(row), row["score"])
    for row in rows:
        row["baseline"] = by_group.get(_group(row))


def _group(row: Row) -> tuple[Any, ...]:
    return tuple(row[key] for key in ("sensor", "task", "rig", "protocol", "split", "repeat"))


def scores_text(rows: Sequence[Row]) -> str:
    """Return what a seed decides, as text that may be compared byte by byte."""
    return json.dumps([{key: row[key] for key in SEED_DECIDES} for row in rows], indent=1, sort_keys=True) + "\n"
