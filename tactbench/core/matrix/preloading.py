"""What several cells need, loaded here before their processes are forked: libraries, our estimators, recordings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import suppress
from pathlib import Path

from tactbench.core.evaluation.libraries import import_libraries
from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.solving import DATASETS, Job, Wanted, our_own, prepare
from tactbench.core.plugins.registry import installed

Groups = Mapping[Wanted, Sequence[Job]]
"""Cells by task and recordings."""


def shared(groups: Groups, choice: EngineChoice) -> Iterator[Job]:
    """Yield the cells group by group; before each group, load here what several of its cells need."""
    from tactbench.core.evaluation.thread_limit import find_libraries

    for (task, recordings), jobs in groups.items():
        import_estimators([job.cell for job in jobs])
        trouble = _read_here(task, recordings, choice) if len(jobs) > 1 else None
        find_libraries()
        for job in jobs:
            yield job._replace(trouble=trouble)


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
    """Prepare each of our own estimators that `cells` use, once; what is wrong with it is its cells'.

    Those of others are imported in their cells' processes only: what an import changes there, such as a library that it
    patches, changes no other cell.
    """
    _import({(cell.estimator, installed().tasks[cell.task].spec.kind) for cell in cells})


def import_ours() -> None:
    """Prepare all of our own estimators."""
    _import({(one.name, kind) for one in installed().estimators for kind in one.kinds})


def _import(several: Set[tuple[str, str]]) -> None:
    from tactbench.core.evaluation.thread_limit import find_libraries

    import_libraries()
    for estimator, kind in sorted(several - _tried):
        _tried.add((estimator, kind))
        if our_own(estimator):
            with suppress(Exception):
                prepare(estimator, kind)
    find_libraries()


_tried: set[tuple[str, str]] = set()
