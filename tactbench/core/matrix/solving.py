"""One cell, carried out in whatever process an engine has chosen for it."""

from __future__ import annotations

import os
import platform
import random
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tactbench.core.errors import EngineError, NotApplicable, RecordingError
from tactbench.core.matrix.answer import answer, opening, stopped
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.store import Row
from tactbench.core.plugins.registry import installed, load_object
from tactbench.core.pool.log import printed
from tactbench.core.provenance.gather import host_id

if TYPE_CHECKING:
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
    try:
        prepare(cell.estimator, registry.tasks[cell.task].spec.kind)
    except MemoryError:
        raise
    except Exception:
        pass  # the cell will tell
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


def our_own(estimator: str) -> bool:
    """Return whether an estimator comes with this package: tested with it, and trusted not to end whoever builds it."""
    return installed().estimators.owned(estimator).module.partition(".")[0] == __name__.partition(".")[0]


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
