"""Which engine carries out cells: the one asked for, or the one that fits the work."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

from tactbench.core.errors import UsageError
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool

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

    def check(self) -> None:
        """Make sure that its parts go together and the engine can be opened, before anything is recorded.

        Raises
        ------
        UsageError
            If they do not, the library of the Dask engine is missing, or nobody answers at the scheduler's address.
        """
        if self.name == "in-process" and self.jobs > 1:
            raise UsageError(
                f"The engine in-process carries out one cell at a time; --jobs {self.jobs} was given.",
                hint="Leave out --jobs, or use --engine isolated.",
            )
        if self.scheduler is not None and self.name != "dask":
            raise UsageError("--scheduler is for --engine dask.", hint="Add --engine dask, or leave it out.")
        if self.name == "dask":
            if importlib.util.find_spec("distributed") is None:
                raise UsageError(
                    "The Dask engine needs the library distributed, which is not installed.",
                    hint="Install it with: pip install 'tactbench[dask]'.",
                )
            from tactbench.core.matrix.dask import check_scheduler

            check_scheduler(self.scheduler)

    def engine(self, cells: int) -> Pool | InProcess | Dask:
        """Return the engine for so many cells.

        Its `each` yields every item exactly once, as they end, with its result or the TactbenchError that stopped it;
        what comes of an item does not depend on the engine, and only a Ctrl-C by the user ends the iteration. In
        process, one cell is carried out here; several in a child process, one at a time.
        """
        if self.name == "dask":
            from tactbench.core.matrix.dask import Dask

            return Dask(self.jobs, self.limits, self.scheduler)
        if self.name == "in-process" and cells == 1:
            return InProcess(self.limits)
        return Pool(self.jobs, self.limits, reuse=self.name == "in-process")
