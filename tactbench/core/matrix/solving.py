"""One cell, carried out in whatever process an engine has chosen for it."""

from __future__ import annotations

import os
import random
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.libraries import import_libraries
from tactbench.core.matrix.answer import answer, opening, stopped
from tactbench.core.matrix.engines.company import company
from tactbench.core.matrix.engines.share import Share
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.pool.log import printed
from tactbench.core.matrix.provenance import host_id
from tactbench.core.matrix.store import Row
from tactbench.core.plugins.registry import installed, load_object

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset

Job = tuple[Cell, tuple[Path, ...], "BaseException | None"]
"""A cell, its recordings, and why there are none if the rig could not make them."""

Wanted = tuple[str, tuple[Path, ...]]
"""A task and recordings."""

this_host = lru_cache(maxsize=1)(host_id)


def prepare(cell: Cell) -> None:
    """Import what a cell's estimator needs, and have it learn a few made-up rows, before any clock is read.

    Done once in a process; a child process does it again, since a fork copies each page of memory when it is first
    written to. Raises whatever the estimator raises.
    """
    registry = installed()
    descriptor = registry.estimators[cell.estimator]
    kind = registry.tasks[cell.task].spec.kind
    here = os.getpid(), cell.estimator, kind
    if here in _prepared:
        return
    _prepared.add(here)
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
        Cells that may be at work at once while this one is timed, where the engine does not know better.
    """
    cell, recordings, trouble = job
    registry = installed()
    if trouble is not None:
        return unanswered(cell, trouble), {}
    try:
        prepare(cell)
    except MemoryError:
        raise
    except Exception:
        pass  # the cell will tell
    began = time.perf_counter()
    _seed_everything(cell.seed)
    row, sets = answer(cell, registry, recordings, DATASETS, working)
    timed = {"wall_s": time.perf_counter() - began, "concurrency": company(concurrency), "host": this_host()}
    columns = {
        str(role): {one.name: getattr(answers, one.name) for one in fields(answers)} for role, answers in sets.items()
    }
    return {**row, **timed, "log": printed()}, columns


def our_own(estimator: str) -> bool:
    """Return whether an estimator comes with this package: tested with it, and trusted not to end whoever builds it."""
    return installed().estimators.owned(estimator).module.partition(".")[0] == __name__.partition(".")[0]


def _shares(job: Job) -> list[Share]:
    """Return what other cells need as well, so that a process may load it for its children."""
    cell, recordings, _ = job
    ours = our_own(cell.estimator)
    return [
        Share("libraries", import_libraries, trusted=True),
        *([Share(("estimator", cell.task, cell.estimator), lambda: prepare(cell), trusted=True)] if ours else []),
        Share(("recordings", cell.task, recordings), lambda: DATASETS(cell.task, recordings)),
    ]


setattr(solve, "shares", _shares)  # noqa: B010  (type checkers know no attributes of functions)


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
