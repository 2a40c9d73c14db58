"""Heavy things once, before processes are forked that share them: recordings and the estimators' libraries."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

from tactbench.core.evaluation.libraries import import_libraries
from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.engines.in_process import InProcess
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solving import DATASETS, Job, Wanted, our_own, prepare

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset

Groups = Mapping[Wanted, Sequence[Job]]
"""Cells by task and recordings."""


class Shared:
    """Yields the cells group by group; before each group, has here what several of its cells need.

    What it has at hand, and says so (see `tactbench.core.matrix.engines.engine.Engine`), are the cells that are left of
    a group. The first one of the next is at hand only if all that it needs is here: else it has recordings read.
    """

    def __init__(self, groups: Groups, choice: EngineChoice) -> None:
        self._groups = deque(groups.items())
        self._choice = choice
        self._at_hand: deque[Job] = deque()

    def __iter__(self) -> Self:
        return self

    def __length_hint__(self) -> int:
        if not self._at_hand and self._groups and _nothing_to_do_for(*self._groups[0]):
            self._take_group()
        return len(self._at_hand)

    def __next__(self) -> Job:
        from tactbench.core.evaluation.thread_limit import find_libraries

        while not self._at_hand:
            if not self._groups:
                raise StopIteration
            self._take_group()
        find_libraries()
        return self._at_hand.popleft()

    def _take_group(self) -> None:
        (task, recordings), jobs = self._groups.popleft()
        trouble = self._prepared(task, recordings, jobs)
        self._at_hand += [(cell, paths, trouble) for cell, paths, _ in jobs]

    def _prepared(self, task: str, recordings: tuple[Path, ...], jobs: Sequence[Job]) -> BaseException | None:
        """Have here what several of `jobs` need; return what is wrong with that."""
        import_estimators([job[0] for job in jobs], self._choice)
        if len(jobs) == 1 or (task, recordings) in DATASETS:
            return None
        # Read in a process of its own: what it does to the reader, it does not do to the run.
        ((_, outcome),) = self._choice.pool(1).each(_read, [(task, recordings)])
        if isinstance(outcome, BaseException):
            return outcome
        DATASETS.keep((task, recordings), outcome)
        return None


def _nothing_to_do_for(wanted: Wanted, jobs: Sequence[Job]) -> bool:
    """Return whether what a group of cells shares is here."""
    read = len(jobs) == 1 or wanted in DATASETS
    return read and all((cell.task, cell.estimator) in _prepared for cell, _, _ in jobs)


def import_estimators(cells: Sequence[Cell], choice: EngineChoice) -> None:
    """Prepare the estimator of each cell once, so that what it imports is there; what is wrong with it is its cells'.

    What others bring is prepared in a process of its own first: only what that process survives, without a thread left
    behind, is done here as well.
    """
    from tactbench.core.evaluation.thread_limit import find_libraries

    import_libraries()
    several = {(cell.task, cell.estimator): cell for cell in cells if (cell.task, cell.estimator) not in _prepared}
    _prepared.update(several)
    foreign = [cell for cell in several.values() if not our_own(cell.estimator)]
    survived = [cell for cell, outcome in choice.pool(1).each(prepare, foreign) if outcome is True] if foreign else []
    # No limit of memory here: a BLAS that is refused some asks again for ever.
    here = InProcess(replace(choice.limits, memory_mb=None))
    for _ in here.each(prepare, [*(set(several.values()) - set(foreign)), *survived]):
        pass
    find_libraries()


_prepared: set[tuple[str, str]] = set()


def _read(wanted: Wanted) -> Dataset:
    return DATASETS(*wanted)
