"""Run of a matrix: planning, recording, evaluation and storage of its cells."""

from __future__ import annotations

import importlib.util
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, Literal

from tactbench.core.errors import RecordingError, UnwritableError, UsageError
from tactbench.core.matrix.keys import Keys, Sections
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.plan_recordings import (
    RecordingPlan,
    RecordingSource,
    RequestKey,
    parts_of,
    plan_parts,
    request_key,
)
from tactbench.core.matrix.solve import Job, published, solve, unanswered
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.declared import declared_in, with_declared
from tactbench.core.plugins.interfaces import Operator, RecordingRequest
from tactbench.core.plugins.registry import Family, Registry, installed
from tactbench.core.plugins.rigs import rig_of, taking_part
from tactbench.core.pool import UNLIMITED, Engine, InProcess, Limits, Pool, preload
from tactbench.core.progress import Progress
from tactbench.core.provenance import gather, usable_cores
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.row import STOPPED
from tactbench.core.spec.task import TaskSpec

EngineName = Literal["in-process", "isolated", "dask"]
GRACE_S = 5.0
"""Time for a real rig to stop and close its devices after a timeout [s]."""


@dataclass(frozen=True)
class EngineChoice:
    """Choice of the engine that evaluates cells, with its number of processes and its limits."""

    name: EngineName = "isolated"
    jobs: int | None = None
    """Number of parallel processes; None: one for each usable core."""
    limits: Limits = UNLIMITED

    @property
    def processes(self) -> int:
        """Number of parallel processes."""
        return self.jobs or usable_cores()

    def check(self) -> None:
        """Raise UsageError if engine and number of jobs are incompatible, or the Dask library is missing."""
        if self.name == "in-process" and (self.jobs or 1) > 1:
            raise UsageError(
                f"The engine in-process evaluates one cell at a time; --jobs {self.jobs} was given.",
                hint="Leave out --jobs, or use --engine isolated.",
            )
        if self.name == "dask" and importlib.util.find_spec("distributed") is None:
            raise UsageError(
                "The Dask engine needs the library distributed, which is not installed.",
                hint="Install it with: pip install 'tactbench[dask]'.",
            )

    def engine(self, jobs: int) -> Engine:
        """Return the engine that evaluates cells, `jobs` at a time on this machine."""
        if self.name == "dask":
            from tactbench.core.matrix.dask import Dask

            return Dask(self.processes, self.limits, os.environ.get("DASK_SCHEDULER_ADDRESS"))
        return InProcess() if self.name == "in-process" else Pool(jobs, self.limits)

    def recorder(self, *, computed: bool) -> Engine:
        """Return the engine that makes recordings: with devices one at a time, and with time to close each device."""
        if self.name == "in-process":
            return InProcess()
        return Pool(self.processes, self.limits) if computed else Pool(1, replace(self.limits, grace_s=GRACE_S))


@dataclass(frozen=True)
class Outcome:
    """Result of a run: rows of all cells, and numbers of cells computed and recordings made."""

    rows: tuple[Row, ...]
    computed: int
    """Number of cells computed in this run; all other cells were reused."""
    recorded: int
    """Number of recordings made in this run."""

    @property
    def failures(self) -> list[Row]:
        """Rows of the cells that failed or were stopped."""
        return [row for row in self.rows if row["status"] in STOPPED]


def run_matrix(
    matrix: MatrixSpec,
    store: Store,
    *,
    choice: EngineChoice | None = None,
    recordings: Path | None = None,
    root: Path | None = None,
    operator: Operator | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Record and evaluate the cells of `matrix`, reusing finished results in `store`.

    Parameters
    ----------
    matrix
        The matrix.
    store
        Result folder.
    choice
        Engine, number of processes and limits; scores do not depend on this choice.
    recordings
        Folder of recordings, for rigs that replay.
    root
        Folder of a copy of the data sets that `matrix` names; see
        :meth:`~tactbench.core.recording.datasets.DataSet.recordings`.
    operator
        Prompts for the operator of a rig of real devices.
    progress
        Display of the progress.

    Raises
    ------
    UsageError
        If a name in the matrix is unknown; no cell is run.
    FolderError
        If the folder is in use by another run or cannot be written; finished cells are kept.
    """
    choice, progress = choice or EngineChoice(), progress or Progress()
    choice.check()
    if choice.name == "dask":
        matrix = matrix.model_copy(update={"latency": False})  # other work may run beside a cell on a cluster
    with store.hold():
        preload("tactbench.core.matrix.preloaded")
        parts = parts_of(matrix, recordings, root, progress)
        declared = chain.from_iterable((*part.declared, *declared_in(part.recordings)) for part in parts)
        registry = with_declared(installed(), declared)
        keys = Keys(registry)
        cells, plan = plan_parts(parts, registry, keys, store, choice.limits)
        store.begin(gather(registry, seed=matrix.seed, engine=choice.name))
        run = Run(store, registry, keys, plan, choice, operator, progress)
        for timed in (True, False):
            run.carry_out([cell for cell in cells if cell.timed == timed], timed=timed)
    return Outcome(tuple(run.rows[cell.name] for cell in cells), run.computed, run.recorded)


@dataclass
class Run:
    """State of a run: its settings, and the rows of the cells evaluated so far."""

    store: Store
    registry: Registry
    keys: Keys
    plan: RecordingPlan
    choice: EngineChoice
    operator: Operator | None
    progress: Progress
    rows: dict[str, Row] = field(default_factory=dict)
    computed: int = 0
    recorded: int = 0

    def carry_out(self, cells: Sequence[Cell], *, timed: bool) -> None:
        """Make the missing recordings of `cells`, then evaluate the cells; timed cells one at a time."""
        by_need: dict[RequestKey, list[Cell]] = {}
        for cell in cells:
            by_need.setdefault(request_key(cell), []).append(cell)
        self._record([request for need in by_need for request in self.plan[need].requests])
        groups = [jobs for need, some in by_need.items() if (jobs := self._jobs(self.plan[need], some))]
        if not groups:
            return
        self.progress.begin("evaluating, timed" if timed else "evaluating", sum(map(len, groups)))
        at_once = 1 if timed or self.choice.name == "in-process" else self.choice.processes
        with self.choice.engine(at_once) as engine:
            self._submit_cells(engine, groups, at_once)
            for job, outcome in engine.outcomes():
                self._ended(job.cell, job.task, outcome, job.key, job.sections, engine.log)
                self.progress.advance(job.cell.name, stopped=self.rows[job.cell.name]["status"] in STOPPED)

    # Recordings

    def _record(self, requests: Sequence[RecordingRequest]) -> None:
        """Make the requested recordings that do not exist yet."""
        self._clear(requests)
        missing = {request.path: request for request in requests if not self._is_there(request)}
        if not missing:
            return
        self.progress.begin("recording", len(missing))
        computed = all(is_computed(request) for request in missing.values())
        # The operator's terminal belongs to this process.
        here = self.operator is not None and not computed
        try:
            with InProcess() if here else self.choice.recorder(computed=computed) as recorder:
                self._submit_recordings(recorder, missing.values(), computed=computed)
                for request, outcome in recorder.outcomes():
                    self._recorded(request, outcome)
        finally:
            self._clear(requests)  # of an interrupted run, too

    def _clear(self, requests: Sequence[RecordingRequest]) -> None:
        """Remove unfinished files of simulations that were killed; data of devices are never removed."""
        computed = {request.path.name for request in requests if is_computed(request)}
        for folder in {request.path.parent for request in requests}:
            for left in folder.glob("*.h5.*"):
                if f"{left.name.partition('.h5.')[0]}.h5" in computed:
                    left.unlink(missing_ok=True)

    def _is_there(self, request: RecordingRequest) -> bool:
        """Return True if the requested recording exists; a damaged simulated recording is removed first."""
        if request.path.exists() and is_computed(request):
            try:
                self.store.about(request.path)
            except RecordingError:
                request.path.unlink()
        return request.path.exists()

    def _submit_recordings(self, recorder: Engine, missing: Iterable[RecordingRequest], *, computed: bool) -> None:
        """Queue recordings: those of a real rig as one piece of work, simulated ones by seed, sensor and packages."""
        pieces: dict[tuple[object, ...], list[RecordingRequest]] = {}
        for request in missing:
            apart = (foreign_components(self.registry, request), request.seed, request.sensor.name) if computed else ()
            pieces.setdefault(apart, []).append(request)
        parts = self.choice.processes if computed and len(pieces) < self.choice.processes else 1
        # Where all are made in one process, those that import no other package are made before one is imported.
        for _, piece in sorted(pieces.items(), key=lambda one: any(one[0][:1])):
            for part in range(min(parts, len(piece))):
                requests = piece[part::parts]
                recorder.submit(Recorder(self.registry, self.operator), requests)

    def _recorded(self, request: RecordingRequest, outcome: Any) -> None:
        if isinstance(outcome, UnwritableError):
            raise outcome  # the disk is no cell's fault, and refuses the next recording too
        stopped = isinstance(outcome, BaseException)
        if stopped:
            if "--rescue" not in str(outcome) and not is_computed(request):
                from tactbench.core.recording.writer import recovery

                journals = sorted(request.path.parent.glob(f"{request.path.name}*.partial"))
                outcome.hint = " ".join([outcome.hint, *(recovery(one, request.path) for one in journals)]).strip()
            for source in self.plan.values():
                if request.path in source.paths:
                    source.trouble = source.trouble or outcome
        self.recorded += not stopped
        self.progress.advance(f"{request.sensor.name} {request.scene.name}", stopped=stopped)

    # Cells

    def _jobs(self, source: RecordingSource, cells: Iterable[Cell]) -> list[Job]:
        """Return jobs for unfinished `cells`, which share recordings; finished or failed cells get their row."""
        jobs = []
        digests: dict[Path, str] = {}
        for cell in cells:
            task = self.registry.tasks[cell.task].spec
            try:
                if source.trouble is not None:
                    raise source.trouble
                digests = digests or {path: self.store.about(path)["digest"] for path in source.paths}
                key, sections = self.keys.of_cell(cell, digests)
            except Exception as error:
                self._ended(cell, task, error)
                continue
            found = self.store.finished(key)
            if found is None:
                estimator = self.registry.estimators[cell.estimator]
                jobs.append(Job(cell, task, estimator, tuple(digests), tuple(digests.values()), key, sections))
                continue
            # Its key covers neither its name nor published figures: they change no number.
            row = {**found, "cell": cell.name, **published(cell, task, found["split"])}
            self.store.reuse(row)
            self.rows[cell.name] = row
        return jobs

    def _submit_cells(self, engine: Engine, groups: Sequence[Sequence[Job]], at_once: int) -> None:
        """Queue cells that share recordings: our own estimators as one piece of work, others one piece for each."""
        work = partial(solve, concurrency=at_once)
        for jobs in groups:
            pieces: dict[object, list[Job]] = {}
            for job in jobs:
                ours = self.registry.estimators.owned(job.estimator.name).ours
                together = ours and (len(groups) >= at_once or at_once == 1)
                pieces.setdefault("ours" if together else job.estimator.name, []).append(job)
            for piece in pieces.values():
                engine.submit(work, piece)

    def _ended(
        self, cell: Cell, task: TaskSpec, outcome: Any, key: str = "", sections: Sections | None = None, log: str = ""
    ) -> None:
        """Store the result of a cell, or the error that stopped the cell."""
        if isinstance(outcome, BaseException):
            row, answers = unanswered(cell, task, outcome, simulated=self.registry.rigs[cell.rig].simulated), None
        else:
            row, answers = outcome
            row |= {"log": log, "recordings": [self.store.beside(Path(path)) for path in row["recordings"]]}
        self.rows[cell.name] = self.store.keep({**row, "key": key}, sections or {}, answers)
        self.computed += 1


class Recorder:
    """Function that makes a recording, for use in a worker; the rig is built at the first call."""

    def __init__(self, registry: Registry, operator: Operator | None) -> None:
        self._operator = operator
        self._built: Any = None
        self._registry = registry.with_tasks(Family("task"))  # tasks would be most of the pickled data

    def __call__(self, request: RecordingRequest) -> None:
        """Make a recording; all errors of the rig are passed on."""
        from tactbench.core.acquisition import acquire

        if self._built is None:
            self._built = rig_of(request.rig.name, self._registry, rig_file=request.rig_file, operator=self._operator)
        # The cost of a simulation is processor time, since several run at once; that of a real rig is wall time.
        acquire(self._built, request, clock=time.process_time if request.rig.simulated else time.perf_counter)


def foreign_components(registry: Registry, request: RecordingRequest) -> tuple[str, ...]:
    """Return the names of the effects and indenter from other packages that are needed for a recording."""
    effects, indenters = taking_part(registry, request.sensor, request.scene), registry.indenters
    shape = str(request.scene.indenter.shape)
    foreign = [shape] if shape in indenters and not indenters.owned(shape).ours else []
    return (*(one.descriptor.name for one in effects if not one.ours), *foreign)


def is_computed(request: RecordingRequest) -> bool:
    """Return True if a recording is computed on this machine, without real devices or wall-clock time."""
    simulated, devices = request.rig.simulated, request.rig_file
    if simulated or devices is None:
        return simulated
    return all(entry.emulated for entry in devices.entries().values())
