"""Cells on a Dask cluster: the same rows as here, whatever workers come and go."""

from __future__ import annotations

import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

from tactbench.core.errors import EngineError
from tactbench.core.matrix.engines.cell_server import thread_bounds
from tactbench.core.matrix.engines.dask_cluster import client_of
from tactbench.core.matrix.engines.dask_crew import Crew
from tactbench.core.matrix.engines.dask_flights import Flight, Round
from tactbench.core.matrix.engines.engine import R, T
from tactbench.core.matrix.engines.request import Setting
from tactbench.core.matrix.engines.sight import fingerprints
from tactbench.core.matrix.engines.surroundings import sources_remembered, surroundings
from tactbench.core.matrix.pool.limits import Limits
from tactbench.core.plugins.registry import installed

ALONE_S = 60.0
"""How long a run waits for a worker when the last one has gone."""


@contextmanager
def open_dask(
    address: str | None, jobs: int, limits: Limits, told: Callable[[str], None] | None = None
) -> Iterator[DaskEngine]:
    """Open the engine.

    Parameters
    ----------
    address
        Of a scheduler, as ``tcp://HOST:8786``; None starts a scheduler and workers on this machine.
    jobs
        Workers to start where there is no address; each computes one cell at a time.
    limits
        What a cell may take.
    told
        Called with a sentence about each worker that came later and is not used.

    Raises
    ------
    UsageError
        If the library is missing or the scheduler does not answer.
    """
    with ExitStack() as stack:
        client, scratch = stack.enter_context(client_of(address, jobs))
        yield stack.enter_context(closing(DaskEngine(client, limits, told, memory=scratch / "sources.json")))


class Dask:
    """The engine, opened when there is something to do.

    Parameters
    ----------
    jobs, limits, scheduler
        As of `open_dask`; `scheduler` is the address.
    """

    def __init__(self, jobs: int, limits: Limits, scheduler: str | None = None) -> None:
        self._jobs, self._limits, self._scheduler = jobs, limits, scheduler

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Open the cluster, yield as `DaskEngine` does, close it."""
        every = list(items)
        if every:
            with open_dask(self._scheduler, self._jobs, self._limits) as engine:
                yield from engine.each(work, every, meanwhile)


class DaskEngine:
    """Cells on the workers of a scheduler, each in a process of its own there.

    This process chooses the worker of each cell and gives it one a thread: so it is known which cell a worker died
    over, and a worker that computes with something else gets none.

    Parameters
    ----------
    client
        A `distributed.Client`.
    limits
        What a cell may take.
    told
        Called with a sentence about each worker that came later and is not used.
    memory
        A file to remember digests of sources in; where workers on this machine find it, they begin sooner.
    alone_s
        How long to wait for a worker when the last one has gone.
    """

    def __init__(
        self,
        client: Any,
        limits: Limits,
        told: Callable[[str], None] | None = None,
        *,
        memory: Path | None = None,
        alone_s: float = ALONE_S,
    ) -> None:
        self._client = client
        self._where = client.scheduler.address
        self._limits = limits
        self._told = told
        self._memory = memory
        self._alone_s = alone_s
        self._crew: Crew | None = None

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result, or with what stopped it, in the order in which they end.

        Raises
        ------
        UsageError
            Before anything is computed: if there is no worker, or one that does not agree with this process.
        """
        waiting = deque(Flight(item) for item in items)
        if not waiting:
            return
        if self._crew is None:
            self._crew = Crew(self._client, self._setting(), self._told)
        crew = self._crew
        crew.gather(fingerprints(waiting[0].item))
        with Round(self._client, crew, work, waiting) as round_:
            if meanwhile is not None:
                meanwhile()
            seen = time.monotonic()
            while round_.busy:
                if self._client.status == "running" and crew.threads:
                    seen = time.monotonic()
                elif self._client.status == "closed" or time.monotonic() - seen > self._alone_s:
                    break
                yield from round_.turn()
            for flight in (*round_.flying.values(), *waiting):
                yield flight.item, self._gone()

    def close(self) -> None:
        """Have the workers end what they keep for this engine."""
        if self._crew is not None:
            self._crew.leave()
            self._crew = None

    def _setting(self) -> Setting:
        memory = str(self._memory or "")
        sources = sources_remembered(memory)
        agreed = surroundings(installed(), sources)
        sources.save()
        folder, threads = str(Path.cwd()), dict(thread_bounds())
        return Setting(uuid.uuid4().hex, folder, self._limits, agreed, memory, threads)

    def _gone(self) -> EngineError:
        what = f"has had no worker for {self._alone_s:.0f} s" if self._client.status == "running" else "went away"
        return EngineError(
            f"The Dask scheduler at {self._where} {what} before this cell was computed.",
            hint="Start it, or workers for it, and give the same command again: what was finished is kept.",
        )
