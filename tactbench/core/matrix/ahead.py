"""What every cell of a fresh folder needs: recordings read in one process while libraries are imported in this one."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.planning import Material
from tactbench.core.matrix.recorded import Read, read_digest
from tactbench.core.matrix.solving import DATASETS, Wanted
from tactbench.core.plugins.registry import installed

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset

MOST_BYTES = 16 * 2**20
"""Of files that are read ahead: what was read of them waits in memory for its turn. The others are read in theirs."""

_Asked = tuple[Sequence[Path], Sequence[Wanted]]
"""Recordings whose digests are wanted, and what is wanted as tasks need it."""


@contextmanager
def read_ahead(cells: Sequence[Cell], material: Material, choice: EngineChoice) -> Iterator[None]:
    """Have the digests and data of small recordings, and the libraries of estimators, before the first cell.

    A recording that cannot be read spoils this for all, and is found out in its turn, when each is read for itself.
    """
    DATASETS.keep_ahead(_data(cells, material, choice))
    try:
        yield
    finally:
        DATASETS.keep_ahead({})


def _data(cells: Sequence[Cell], material: Material, choice: EngineChoice) -> dict[Wanted, Dataset]:
    from tactbench.core.matrix.preloading import import_estimators

    served = [cell for cell in cells if material.trouble(cell) is None]
    small = _small(path for cell in served for path in material.paths(cell))
    times = Counter((cell.task, tuple(material.paths(cell))) for cell in served)
    several = [wanted for wanted, number in times.items() if number > 1 and small.keys() >= set(wanted[1])]
    asked: _Asked = (material.recorded.unread(small, "digest"), several)
    if not any(asked):
        return {}
    importlib.import_module("h5py")  # once here, not once in every process that reads
    ((_, outcome),) = choice.pool(1).each(_read, [asked], lambda: import_estimators(served, choice))
    if isinstance(outcome, BaseException):
        return {}
    for path, read in zip(asked[0], outcome[0], strict=True):
        material.recorded.learn(path, read)
    return dict(zip(several, outcome[1], strict=True))


def _small(paths: Iterable[Path]) -> dict[Path, None]:
    """Return the first of `paths`, as many as are not too much together."""
    found: dict[Path, None] = {}
    left = MOST_BYTES
    for path in dict.fromkeys(paths):
        try:
            left -= path.stat().st_size
        except OSError:
            continue
        if left < 0:
            break
        found[path] = None
    return found


def _read(asked: _Asked) -> tuple[list[Read], list[Dataset]]:
    from tactbench.core.evaluation.dataset import load_dataset

    paths, several = asked
    tasks = installed().tasks
    return [read_digest(path) for path in paths], [load_dataset(tasks[task].spec, some) for task, some in several]
