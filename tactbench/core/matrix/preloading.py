"""What several cells need, loaded here before their processes are forked: libraries, our estimators, recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from tactbench.core.evaluation.libraries import import_libraries
from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.engines.in_process import InProcess
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solving import DATASETS, Job, Wanted, our_own, prepare

Groups = Mapping[Wanted, Sequence[Job]]
"""Cells by task and recordings."""


def shared(groups: Groups, choice: EngineChoice) -> Iterator[Job]:
    """Yield the cells group by group; before each group, load here what several of its cells need."""
    from tactbench.core.evaluation.thread_limit import find_libraries

    for (task, recordings), jobs in groups.items():
        import_estimators([job[0] for job in jobs])
        trouble = _read_here(task, recordings, choice) if len(jobs) > 1 else None
        find_libraries()
        for cell, paths, _ in jobs:
            yield cell, paths, trouble


def _read_here(task: str, recordings: tuple[Path, ...], choice: EngineChoice) -> BaseException | None:
    """Have recordings in memory; return what is wrong with them.

    They are read by a child process first: only what that survives is read here as well.
    """
    if (task, recordings) in DATASETS:
        return None
    ((_, outcome),) = choice.pool(1).each(_readable, [(task, recordings)])
    if isinstance(outcome, BaseException):
        return outcome
    DATASETS(task, recordings)
    return None


def _readable(wanted: Wanted) -> bool:
    DATASETS(*wanted)
    return True


def import_estimators(cells: Sequence[Cell]) -> None:
    """Prepare each of our own estimators once; what is wrong with it is its cells'.

    Those of others are imported in their cells' processes only: what an import changes there, such as a library that it
    patches, changes no other cell.
    """
    from tactbench.core.evaluation.thread_limit import find_libraries

    import_libraries()
    several = {(cell.task, cell.estimator): cell for cell in cells if our_own(cell.estimator)}
    # No limits here: a BLAS that is refused memory asks again for ever, and a library half imported when time is up
    # is broken for every cell.
    for _ in InProcess().each(prepare, [cell for key, cell in several.items() if key not in _prepared]):
        pass
    _prepared.update(several)
    find_libraries()


_prepared: set[tuple[str, str]] = set()
