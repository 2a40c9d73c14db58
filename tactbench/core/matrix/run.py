"""A run: plan, record, evaluate, store; then the rows, in the order of the plan."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Any

from tactbench.core.matrix.context import RunContext
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.evaluate import evaluate_all
from tactbench.core.matrix.key_book import book_of
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan_recordings import plan_run, request_key
from tactbench.core.matrix.progress import Progress, Silence
from tactbench.core.matrix.record import acquire_missing
from tactbench.core.matrix.recorded import Recorded
from tactbench.core.matrix.store import Row, Store
from tactbench.core.matrix.summary import fill_baselines, scores_text
from tactbench.core.plugins.declared import declared_in, with_declared
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import installed
from tactbench.core.provenance.gather import gather
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.status import STOPPED


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
    """The files each cell was evaluated on, by its name."""

    @property
    def failures(self) -> list[Row]:
        """The rows of cells that should have ended otherwise."""
        return [row for row in self.rows if row["status"] in STOPPED]


def run_matrix(
    matrix: MatrixSpec,
    store: Store,
    *,
    choice: EngineChoice | None = None,
    recordings: Path | None = None,
    operator: Operator | None = None,
    progress: Progress | None = None,
    shown: Callable[[Sequence[Row]], None] | None = None,
    files: bool = True,
) -> Outcome:
    """Record and evaluate `matrix`, reusing what `store` already has.

    Parameters
    ----------
    matrix
        What to run.
    store
        Where results lie.
    choice
        Where the work is done, how much of it at once and within which limits; results do not depend on it, times may.
    recordings
        Folder for rigs that replay.
    operator
        Who mounts caps and presses, at a rig of real devices.
    progress
        Receives what happens.
    shown
        Called with all rows so far after each replicate but the last.
    files
        Whether to write ``run.json`` and ``scores.json``; else those of the last run stay as they are.

    Raises
    ------
    UsageError
        If the matrix asks for something that is not there. Nothing has been run then.
    FolderError
        If another run holds the folder, or the disk refuses; what was finished before is kept.
    """
    choice = choice or EngineChoice()
    choice.check()
    progress = progress or Silence()
    with store.hold():
        registry = with_declared(installed(), declared_in(recordings))
        keys = Keys(registry)
        recorded = Recorded(store.folder / "cache" / "recordings.json")
        cells, recording_plan = plan_run(matrix, registry, keys, store, recordings, recorded, choice.limits)
        provenance = gather(keys.sources, seed=matrix.seed, jobs=choice.jobs, engine=choice.name)
        run = RunContext(
            store, keys, book_of(store.folder), recording_plan, recorded, choice, progress,
            made_by=store.begin(provenance),
        )  # fmt: skip
        rows: list[Row] = []
        computed = 0
        # Between replicates nothing is under way, so that a table can be shown. A cluster takes seconds to start, and
        # recordings that exist are read once: all at once there.
        rounds = [cells]
        if recording_plan.requests and choice.name != "dask":
            number_of = attrgetter("repeat")
            rounds = [list(some) for _, some in groupby(sorted(cells, key=number_of), key=number_of)]
        for number, some in enumerate(rounds, 1):
            prefix = f"replicate {number} of {len(rounds)}: " if len(rounds) > 1 else ""
            acquire_missing(run, some, operator, stage=f"{prefix}recording")
            found, now = evaluate_all(run, some, stage=f"{prefix}evaluating")
            rows += found
            computed += now
            if shown is not None and now and number < len(rounds):
                shown(tuple(rows))
        fill_baselines(rows)
        recorded.save()
        if files:
            store.write("run.json", json.dumps(provenance, indent=1, sort_keys=True) + "\n")
            store.write("scores.json", scores_text(rows))
    used = {cell.name: tuple(recording_plan.paths.get(request_key(cell), ())) for cell in cells}
    return Outcome(tuple(rows), provenance, computed, len(recorded.made), used)
