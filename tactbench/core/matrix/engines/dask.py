"""Cells on a Dask cluster: the same rows as here, whatever workers come and go."""

from __future__ import annotations

import time
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Generic

from tactbench.core.errors import Crashed, EngineError
from tactbench.core.matrix.engines.cell_server import thread_bounds
from tactbench.core.matrix.engines.dask_cluster import client_of
from tactbench.core.matrix.engines.dask_crew import POLL_S, Crew
from tactbench.core.matrix.engines.dask_worker import carry_out
from tactbench.core.matrix.engines.engine import R, T
from tactbench.core.matrix.engines.limits import Limits
from tactbench.core.matrix.engines.request import Request, Setting, pack, unpack_reply
from tactbench.core.matrix.engines.sight import fingerprints
from tactbench.core.matrix.engines.surroundings import surroundings
from tactbench.core.matrix.installed import installed

DEATHS = 3
"""So many workers may die over a cell; after the first it has a worker for itself, so that it is known who did it."""
ALONE_S = 60.0
"""How long a run waits for a worker when the last one has gone."""
ARRIVE_S = 60.0
"""How long what a worker has computed may take to arrive."""
LOSSES = 5
"""So often a cell is sent again whose result did not arrive."""


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
    with client_of(address, jobs) as client, closing(DaskEngine(client, limits, told)) as engine:
        yield engine


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


@dataclass(eq=False)
class _Flight(Generic[T]):
    """One item on its way."""

    item: T
    deaths: int = 0
    """Workers that have died over it"""
    lost: int = 0
    """Results that did not arrive"""
    address: str = ""
    future: Any = None


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
    alone_s
        How long to wait for a worker when the last one has gone.
    """

    def __init__(
        self, client: Any, limits: Limits, told: Callable[[str], None] | None = None, *, alone_s: float = ALONE_S
    ) -> None:
        self._client = client
        self._where = client.scheduler.address
        self._limits = limits
        self._told = told
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
        waiting = deque(_Flight(item) for item in items)
        if not waiting:
            return
        if self._crew is None:
            self._crew = Crew(self._client, self._setting(), self._told)
        crew = self._crew
        crew.gather(fingerprints(waiting[0].item))
        with _Round(self._client, crew, work, waiting) as round_:
            if meanwhile is not None:
                meanwhile()
            seen = time.monotonic()
            while waiting or round_.flying:
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
        agreed = surroundings(installed())
        return Setting(uuid.uuid4().hex, str(Path.cwd()), self._limits, agreed, dict(thread_bounds()))

    def _gone(self) -> EngineError:
        what = f"has had no worker for {self._alone_s:.0f} s" if self._client.status == "running" else "went away"
        return EngineError(
            f"The Dask scheduler at {self._where} {what} before this cell was computed.",
            hint="Start it, or workers for it, and give the same command again: what was finished is kept.",
        )


class _Round(Generic[T]):
    """Cells on their way to workers and back.

    Parameters
    ----------
    client
        A `distributed.Client`.
    crew
        Who may compute.
    work
        What is to be done with an item.
    waiting
        What has not been sent; taken from and given back to.
    """

    def __init__(self, client: Any, crew: Crew, work: Callable[[T], Any], waiting: deque[_Flight[T]]) -> None:
        self._client, self._crew, self._work, self._waiting = client, crew, work, waiting
        self._arrivals: SimpleQueue[str] = SimpleQueue()
        self.flying: dict[str, _Flight[T]] = {}

    def __enter__(self) -> _Round[T]:
        self._send()
        return self

    def __exit__(self, *_: object) -> None:
        if self.flying and self._client.status == "running":
            with suppress(OSError, TimeoutError):
                self._client.cancel([flight.future for flight in self.flying.values()], force=True)
            self._crew.leave()  # with the cells at work

    def turn(self) -> Iterator[tuple[T, Any]]:
        """Wait a moment; yield what has come back."""
        self._crew.look()
        for key in [key for key, flight in self.flying.items() if flight.address not in self._crew.threads]:
            flight = self.flying.pop(key)
            flight.future.cancel()
            flight.deaths += 1
            if flight.deaths < DEATHS:
                self._waiting.appendleft(flight)
            else:
                yield flight.item, _killer(flight)
        self._send()
        try:
            flight = self.flying.pop(self._arrivals.get(timeout=POLL_S))
        except (Empty, KeyError):
            return  # nothing, or something that was given up before
        outcome = _outcome(flight)
        if outcome is None and flight.lost < LOSSES:
            flight.lost += 1
            self._waiting.appendleft(flight)
            return
        self._send()  # the worker has its next cell before this one is written
        yield flight.item, _lost(flight) if outcome is None else outcome

    def _send(self) -> None:
        """Send what is waiting to workers with a free thread."""
        if self._client.status != "running":
            return
        free = dict(self._crew.threads)
        for flight in self.flying.values():
            if flight.address in free:
                free[flight.address] -= self._share(flight, flight.address)
        while self._waiting and free:
            flight = self._waiting[0]
            address = max(free, key=lambda one: free[one])
            if free[address] < self._share(flight, address):
                return
            self._waiting.popleft()
            free[address] -= self._share(flight, address)
            flight.address = address
            request = pack(Request(self._work, flight.item, fingerprints(flight.item)))
            flight.future = self._client.submit(
                carry_out, self._crew.setting, f"Dask worker {address}", request,
                pure=False, workers=[address], allow_other_workers=False,
            )  # fmt: skip
            self.flying[flight.future.key] = flight
            flight.future.add_done_callback(self._arrived)

    def _share(self, flight: _Flight[T], address: str) -> int:
        """Return how many threads of a worker a flight takes: all of them once a worker has died over it."""
        return self._crew.threads[address] if flight.deaths else 1

    def _arrived(self, future: Any) -> None:
        self._arrivals.put(future.key)


def _outcome(flight: _Flight[Any]) -> Any:
    """Return what came of a flight; None if that got lost with its worker or with the scheduler."""
    from distributed import KilledWorker
    from distributed.scheduler import NoValidWorkerError

    if flight.future.status == "error":
        error = flight.future.exception()
        if isinstance(error, KilledWorker):
            return _killer(flight)
        if isinstance(error, NoValidWorkerError):
            return None
        return EngineError(f"The Dask worker at {flight.address} could not pass the cell on: {error!r}.")
    if flight.future.status != "finished":
        return None
    try:
        return unpack_reply(flight.future.result(timeout=ARRIVE_S)).outcome
    except (OSError, TimeoutError, CancelledError):
        return None


def _killer(flight: _Flight[Any]) -> Crashed:
    return Crashed(
        f"Workers ended over this cell again and again, the last one at {flight.address}.",
        hint="The cell, or a plugin it loads, ends processes other than its own; or the workers' machine has trouble.",
    )


def _lost(flight: _Flight[Any]) -> EngineError:
    return EngineError(
        f"What the Dask worker at {flight.address} computed did not arrive here, nor what {LOSSES} workers before it.",
        hint="See that workers and scheduler can reach each other.",
    )
