"""Which engine: the one asked for, or the one that fits the work."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, get_args

from tactbench.core.errors import UsageError
from tactbench.core.evaluation.libraries import EVERY_CELL
from tactbench.core.matrix.engines.engine import Engine
from tactbench.core.matrix.pool.limits import UNLIMITED, Limits
from tactbench.core.matrix.pool.processes import can_fork

EngineName = Literal["in-process", "isolated", "dask"]
ENGINES: tuple[EngineName, ...] = get_args(EngineName)


@dataclass(frozen=True)
class EngineChoice:
    """How cells are to be carried out."""

    name: EngineName | None = None
    """None: in process for one cell without limits, isolated otherwise."""
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
            from tactbench.core.matrix.engines.dask_cluster import check_scheduler

            check_scheduler(self.scheduler)

    def named(self, cells: int) -> EngineName:
        """Return the name of the engine for so many cells."""
        if self.name is not None:
            return self.name
        return "in-process" if cells == 1 and self.limits == UNLIMITED else "isolated"

    def concurrency(self, cells: int) -> int:
        """Return how many of so many cells are carried out at once."""
        return 1 if self.named(cells) == "in-process" else max(1, min(self.jobs, cells))

    def forks(self, cells: int) -> bool:
        """Return whether each cell is forked off this process, and shares what it holds at that moment."""
        return self.named(cells) != "dask" and not self.here(cells) and can_fork()

    def here(self, cells: int) -> bool:
        """Return whether cells are really carried out in this process: one that aborts ends it."""
        return self.named(cells) == "in-process" and cells == 1

    def engine(self, cells: int) -> Engine:
        """Return the engine for so many cells.

        In process, one cell is carried out here; of several, each in a child process, one at a time.
        """
        name = self.named(cells)
        if name == "dask":
            from tactbench.core.matrix.engines.dask import Dask

            return Dask(self.jobs, self.limits, self.scheduler)
        if self.here(cells):
            from tactbench.core.matrix.engines.in_process import InProcess

            return InProcess(self.limits)
        from tactbench.core.matrix.pool.pool import Pool

        return Pool(self.concurrency(cells), self.limits, preload=_preload())

    def pool(self, jobs: int, *, grace_s: float = 0.0) -> Engine:
        """Return reused processes for `jobs` items at once, for what is no cell."""
        from tactbench.core.matrix.pool.pool import Pool

        return Pool(jobs, replace(self.limits, grace_s=grace_s), reuse=True, preload=_preload())


def _preload() -> tuple[str, ...] | None:
    return None if can_fork() else EVERY_CELL
