"""A run: plan, acquire, evaluate, store; then the rows, in the order of the plan."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from tactbench.core.errors import NotApplicable, UsageError
from tactbench.core.matrix.execution import InProcess, Job, Workers, installed, prepare, record, rig_of, solve, workers
from tactbench.core.matrix.keys import cell_key
from tactbench.core.matrix.material import Need, Order, need_of, on_the_shelf, orders_for, sensors_on, serving
from tactbench.core.matrix.plan import Cell, plan_cells
from tactbench.core.matrix.progress import Progress, Silence
from tactbench.core.matrix.provenance import gather
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.interfaces import Shelf
from tactbench.core.plugins.registry import Registry
from tactbench.core.recording.format import partial_path
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
    cells, material = _material(matrix, registry, sources, store, recordings)
    troubles = _acquire(cells, material, jobs, told)
    with workers(jobs) as crew:
        rows, computed = _evaluate(cells, material, troubles, crew, jobs, registry, sources, store, told)
    sources.save()
    fill_baselines(rows)
    provenance = gather()
    provenance["jobs"] = jobs
    used = {cell.name: tuple(material.paths(cell)) for cell in cells}
    return Outcome(tuple(rows), provenance, computed, len(material.made), used)


@dataclass
class _Material:
    orders: dict[Need, list[Order]]
    shelf: dict[Need, list[Path]]
    made: dict[Path, str] = field(default_factory=dict)
    """Content digests of the recordings made now."""

    def paths(self, cell: Cell) -> list[Path]:
        wanted = need_of(cell)
        return self.shelf.get(wanted) or [order.path for order in self.orders.get(wanted, ())]


def _material(
    matrix: MatrixSpec, registry: Registry, sources: SourceDigests, store: Store, recordings: Path | None
) -> tuple[list[Cell], _Material]:
    rig = rig_of(matrix.rig, registry, recordings)
    if hasattr(rig, "recordings"):
        found = on_the_shelf(cast(Shelf, rig))
        cells = plan_cells(matrix, sensors_on(found, matrix.sensors), registry)
        shelf = {
            wanted: serving(registry.tasks[wanted[1]].spec, wanted[2], found[wanted[0]])
            for wanted in dict.fromkeys(need_of(cell) for cell in cells)
        }
        return cells, _Material({}, shelf)
    if not matrix.sensors:
        raise UsageError("No sensor is named.", hint=f"Give --sensor; known: {', '.join(registry.sensors.names())}.")
    sensors = [registry.sensors[name].name for name in matrix.sensors]
    cells = plan_cells(matrix, sensors, registry)
    return cells, _Material(orders_for(cells, registry, sources, store, matrix.simulation), {})


def _acquire(cells: Sequence[Cell], material: _Material, jobs: int, told: Progress) -> dict[Path, BaseException]:
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
    simulated = all(installed().rigs[order.rig].simulated for order in missing)
    hands = max(jobs, os.cpu_count() or 1) if simulated else 1
    told.begin("recording", len(missing), alone=hands == 1)

    def note(order: Order, outcome: str | BaseException) -> None:
        if isinstance(outcome, BaseException):
            troubles[order.path] = outcome
        else:
            material.made[order.path] = outcome
        told.advance(f"{order.sensor} {order.scene.name}")

    try:
        for order, outcome in InProcess().each(record, missing[:1]):
            note(order, outcome)
        if missing[1:]:
            with workers(min(hands, len(missing) - 1)) as crew:
                for order, outcome in crew.each(record, missing[1:], meanwhile=lambda: _import_estimators(cells)):
                    note(order, outcome)
    except BaseException:
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
    material: _Material,
    troubles: dict[Path, BaseException],
    crew: Workers,
    jobs: int,
    registry: Registry,
    sources: SourceDigests,
    store: Store,
    told: Progress,
) -> tuple[list[Row], int]:
    digests = _Digests(material.made)
    rows: dict[str, Row] = {}
    keys: dict[str, str] = {}
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
                keys[cell.name] = cell_key(cell, [digests[path] for path in paths], registry, sources)
            except Exception as error:
                trouble = error
        known = store.finished(keys[cell.name]) if trouble is None else None
        if known is not None and known["status"] == "done":
            rows[cell.name] = {**known, "cell": cell.name, "repeat": cell.repeat, "repeats": cell.repeats}
        else:
            waiting.append((cell, tuple(paths), trouble))
    if waiting:
        told.begin("evaluating", len(waiting), alone=jobs == 1)
        work: Callable[[Job], Any] = solve if jobs > 1 else (lambda job: solve(job, told.working))
        for (cell, _, trouble), outcome in crew.each(work, waiting):
            row, sets = outcome if not isinstance(outcome, BaseException) else solve((cell, (), outcome))
            row["key"] = keys.get(cell.name, "")
            row["recordings"] = [_beside(path, store.folder) for path in row["recordings"]]
            if row["status"] == "done" and trouble is None:
                store.keep(row["key"], row, sets)
            rows[cell.name] = row
            told.advance(cell.name)
    return [rows[cell.name] for cell in cells], len(waiting)


def _beside(path: str, folder: Path) -> str:
    """Return `path` relative to the result folder where it lies inside, so that the folder may be moved."""
    inside = Path(path).is_relative_to(folder)
    return str(Path(path).relative_to(folder)) if inside else str(Path(path).resolve())


class _Digests(dict[Path, str]):
    """Content digests of recordings, each read once."""

    def __missing__(self, path: Path) -> str:
        from tactbench.core.recording.reader import content_digest

        self[path] = content_digest(path)
        return self[path]


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
