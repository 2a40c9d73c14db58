"""Which engine carries out cells: the one asked for, or the one that fits the work."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, get_args

from tactbench.core.errors import UsageError
from tactbench.core.matrix.evaluate_cell import PRELOAD
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool
from tactbench.core.pool.processes import can_fork

if TYPE_CHECKING:
    from tactbench.core.matrix.dask import Dask

EngineName = Literal["in-process", "isolated", "dask"]
ENGINES: tuple[EngineName, ...] = get_args(EngineName)


@dataclass(frozen=True)
class EngineChoice:
    """How cells are to be carried out."""

    name: EngineName = "isolated"
    jobs: int = 1
    """Cells at once."""
    limits: Limits = field(default_factory=Limits)
    scheduler: str | None = None
    """Address of a Dask scheduler; None: a cluster on this machine."""

    def checked(self) -> EngineChoice:
        """Return this choice; raise UsageError if its parts do not go together."""
        if self.name == "in-process" and self.jobs > 1:
            raise UsageError(
                f"The engine in-process carries out one cell at a time; --jobs {self.jobs} was given.",
                hint="Leave out --jobs, or use --engine isolated.",
            )
        if self.scheduler is not None and self.name != "dask":
            raise UsageError("--scheduler is for --engine dask.", hint="Add --engine dask, or leave it out.")
        return self

    def ready(self) -> None:
        """Make sure that the engine can be opened, before anything is recorded.

        Raises
        ------
        UsageError
            If the library of the Dask engine is missing, or nobody answers at the scheduler's address.
        """
        if self.name == "dask":
            if importlib.util.find_spec("distributed") is None:
                raise UsageError(
                    "The Dask engine needs the library distributed, which is not installed.",
                    hint="Install it with: pip install 'tactbench[dask]'.",
                )
            from tactbench.core.matrix.dask import check_scheduler

            check_scheduler(self.scheduler)

    def concurrency(self, cells: int) -> int:
        """Return how many of so many cells are carried out at once."""
        return 1 if self.name == "in-process" else max(1, min(self.jobs, cells))

    def forks(self, cells: int) -> bool:
        """Return whether each cell is forked off this process, and shares what it holds at that moment."""
        return self.name != "dask" and not self.here(cells) and can_fork()

    def here(self, cells: int) -> bool:
        """Return whether cells are really carried out in this process: one that aborts ends it."""
        return self.name == "in-process" and cells == 1

    def engine(self, cells: int) -> Pool | InProcess | Dask:
        """Return the engine for so many cells.

        Its `each` yields every item exactly once, as they end, with its result or the TactbenchError that stopped it;
        what comes of an item does not depend on the engine, and only a Ctrl-C by the user ends the iteration. In
        process, one cell is carried out here; of several, each in a child process, one at a time.
        """
        if self.name == "dask":
            from tactbench.core.matrix.dask import Dask

            return Dask(self.jobs, self.limits, self.scheduler)
        if self.here(cells):
            return InProcess(self.limits)
        return Pool(self.concurrency(cells), self.limits, preload=preload())

    def pool(self, jobs: int, *, grace_s: float = 0.0, reuse: bool = True) -> Pool:
        """Return processes for `jobs` items at once, for what is no cell."""
        return Pool(jobs, replace(self.limits, grace_s=grace_s), reuse=reuse, preload=preload())


def preload() -> tuple[str, ...] | None:
    """Return what a fork server is to import; None where this process may fork itself."""
    return None if can_fork() else PRELOAD
