"""Cells on their way to Dask workers and back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any, Generic

from tactbench.core.errors import Crashed, EngineError
from tactbench.core.matrix.engines.dask_crew import POLL_S, Crew
from tactbench.core.matrix.engines.dask_worker import carry_out
from tactbench.core.matrix.engines.engine import T
from tactbench.core.matrix.engines.request import Request, pack, unpack_reply
from tactbench.core.matrix.engines.sight import fingerprints

DEATHS = 3
"""So many workers may die over a cell; after the first it has a worker for itself, so that it is known who did it."""
ARRIVE_S = 60.0
"""How long what a worker has computed may take to arrive."""
LOSSES = 5
"""So often a cell is sent again whose result did not arrive."""


@dataclass(eq=False)
class Flight(Generic[T]):
    """One item on its way."""

    item: T
    deaths: int = 0
    """Workers that have died over it"""
    lost: int = 0
    """Results that did not arrive"""
    address: str = ""
    future: Any = None


class Round(Generic[T]):
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

    def __init__(self, client: Any, crew: Crew, work: Callable[[T], Any], waiting: deque[Flight[T]]) -> None:
        self._client, self._crew, self._work, self._waiting = client, crew, work, waiting
        self._number = len(waiting)
        self._arrivals: SimpleQueue[str] = SimpleQueue()
        self._unsent: list[tuple[T, EngineError]] = []
        self.flying: dict[str, Flight[T]] = {}

    def __enter__(self) -> Round[T]:
        self._send()
        return self

    def __exit__(self, *_: object) -> None:
        if self.flying and self._client.status == "running":
            with suppress(OSError, TimeoutError):
                self._client.cancel([flight.future for flight in self.flying.values()], force=True)
            self._crew.leave()  # with the cells at work

    @property
    def busy(self) -> bool:
        """Whether there is anything left to send, to wait for or to tell."""
        return bool(self._waiting or self.flying or self._unsent)

    def turn(self) -> Iterator[tuple[T, Any]]:
        """Wait a moment; yield what has come back."""
        self._crew.look()
        for key in [key for key, flight in self.flying.items() if flight.address not in self._crew.threads]:
            flight = self.flying.pop(key)
            flight.future.cancel()
            flight.future.release()
            flight.deaths += 1
            if flight.deaths < DEATHS:
                self._waiting.appendleft(flight)
            else:
                yield flight.item, _killer(flight)
        self._send()
        while self._unsent:
            yield self._unsent.pop()
        if not self.flying and not self._waiting:
            return
        try:
            flight = self.flying.pop(self._arrivals.get(timeout=POLL_S))
        except (Empty, KeyError):
            return  # nothing, or something that was given up before
        outcome = _outcome(flight)
        flight.future.release()  # here, and not by its destructor: there a Ctrl-C would be lost
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
            where, company = f"The Dask worker at {address}", min(self._crew.company(address), self._number)
            try:
                request = pack(Request(self._work, flight.item, fingerprints(flight.item), where, company))
            except Exception as error:
                self._unsent.append((flight.item, EngineError(f"The cell cannot be sent to a worker: {error}.")))
                continue
            free[address] -= self._share(flight, address)
            flight.address = address
            flight.future = self._client.submit(
                carry_out, self._crew.setting, where, request,
                pure=False, workers=[address], allow_other_workers=False,
            )  # fmt: skip
            self.flying[flight.future.key] = flight
            flight.future.add_done_callback(self._arrived)

    def _share(self, flight: Flight[T], address: str) -> int:
        """Return how many threads of a worker a flight takes: all of them once a worker has died over it."""
        return self._crew.threads[address] if flight.deaths else 1

    def _arrived(self, future: Any) -> None:
        self._arrivals.put(future.key)


def _outcome(flight: Flight[Any]) -> Any:
    """Return what came of a flight; None if that got lost with its worker or with the scheduler."""
    from distributed import KilledWorker

    if flight.future.status == "error":
        error = flight.future.exception()
        if isinstance(error, KilledWorker):
            return _killer(flight)
        if type(error).__name__ == "NoValidWorkerError":  # newer than the oldest version that serves
            return None
        return EngineError(f"The Dask worker at {flight.address} could not pass the cell on: {error!r}.")
    if flight.future.status != "finished":
        return None
    try:
        return unpack_reply(flight.future.result(timeout=ARRIVE_S)).outcome
    except (OSError, TimeoutError, CancelledError):
        return None


def _killer(flight: Flight[Any]) -> Crashed:
    return Crashed(
        f"Workers ended over this cell again and again, the last one at {flight.address}.",
        hint="The cell, or a plugin it loads, ends processes other than its own; or the workers' machine has trouble.",
    )


def _lost(flight: Flight[Any]) -> EngineError:
    return EngineError(
        f"What the Dask worker at {flight.address} computed did not arrive here, nor what {LOSSES} workers before it.",
        hint="See that workers and scheduler can reach each other.",
    )
