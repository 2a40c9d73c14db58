"""Carrying out orders and cells, here or in worker processes; the results do not depend on which."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from tactbench.core.errors import NotApplicable, RigError
from tactbench.core.matrix.answer import Answer, answer, failed, opening
from tactbench.core.matrix.material import Order
from tactbench.core.matrix.plan import Cell
from tactbench.core.plugins.interfaces import Rig, RigContext, Shelf
from tactbench.core.plugins.registry import Registry, installed, load_object

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset

T = TypeVar("T")
R = TypeVar("R")


class Workers(Protocol):
    """Where work is done."""

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result, or with the exception that stopped it, as they come.

        `meanwhile` is done here while workers elsewhere are busy.
        """


class InProcess:
    """One after the other, here."""

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or its exception; nothing can be done meanwhile."""
        for item in items:
            try:
                yield item, work(item)
            except Exception as error:
                yield item, error


class Processes:
    """Several at once, each in a process of its own that is reused."""

    def __init__(self, pool: ProcessPoolExecutor) -> None:
        self._pool = pool

    def each(
        self, work: Callable[[T], R], items: Iterable[T], meanwhile: Callable[[], None] | None = None
    ) -> Iterator[tuple[T, R | BaseException]]:
        """Yield every item with its result or its exception, in the order in which they end."""
        with _interrupts_held_back():
            futures: dict[Future[R], T] = {self._pool.submit(work, item): item for item in items}
        if meanwhile is not None:
            meanwhile()
        for future in as_completed(futures):
            error = future.exception()
            yield futures[future], error if error is not None else future.result()


@contextmanager
def workers(jobs: int) -> Iterator[Workers]:
    """Open `jobs` workers: this process for one, a pool of processes for more."""
    if jobs == 1:
        yield InProcess()
        return
    pool = ProcessPoolExecutor(jobs, mp_context=get_context(_start_method()))
    try:
        yield Processes(pool)
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in list((pool._processes or {}).values()):
            process.terminate()
        raise
    pool.shutdown()


def _start_method() -> str:
    """Return ``fork`` where this process is its only thread, else ``spawn``.

    A fork costs milliseconds and a fresh interpreter most of a second; but a fork of a process with threads copies
    their locks in an undefined state. The command line keeps BLAS at one thread, so that there are none.
    """
    try:
        threads = len(list(Path("/proc/self/task").iterdir()))
    except OSError:
        return "spawn"
    return "fork" if threads == 1 else "spawn"


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Start processes that are deaf to Ctrl-C from their first instruction on: it is the parent that ends them.

    A terminal sends the interrupt to all of them at once, and one that is still starting would print where it was. The
    signal is blocked, which children inherit; one that comes meanwhile waits here and is delivered afterwards.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def rig_of(name: str, registry: Registry, recordings: Path | None = None) -> Rig | Shelf:
    """Build the rig called `name`."""
    descriptor = registry.rigs[name]
    built = load_object(descriptor.where)(RigContext(effects=tuple(registry.effects), recordings=recordings))
    if not (hasattr(built, "open") or hasattr(built, "recordings")):
        raise RigError(
            f"The rig {name!r} has neither open() nor recordings().", hint="See docs/plugins.md: a Rig or a Shelf."
        )
    return built  # type: ignore[no-any-return]


@lru_cache(maxsize=4)
def _rig(name: str) -> Rig:
    return rig_of(name, installed())  # type: ignore[return-value]


def record(order: Order) -> str:
    """Make one recording and return its content digest. Raises whatever the rig raises."""
    from tactbench.core.acquisition import acquire

    registry = installed()
    rig = registry.rigs[order.rig]
    made = acquire(
        _rig(order.rig),
        registry.sensors[order.sensor],
        rig,
        order.scene,
        role=order.role,
        seed=order.seed,
        path=order.path,
        # Simulations run side by side: what they cost is the processor's time. A real rig is waited for.
        clock=time.process_time if rig.simulated else time.perf_counter,
        provenance={},
    )
    return made.content_digest


def prepare(cell: Cell) -> None:
    """Import what a cell's estimator needs, so that no clock and no waiting person sees it later."""
    registry = installed()
    descriptor = registry.estimators[cell.estimator]
    kind = registry.tasks[cell.task].spec.kind
    with suppress(Exception):  # what is wrong with it is the cell's to tell
        load_object(descriptor.where)(kind=kind, seed=0, threads=1, **descriptor.params)


@lru_cache(maxsize=2)
def _dataset(task: str, recordings: tuple[Path, ...]) -> Dataset:
    from tactbench.core.evaluation.dataset import load_dataset

    return load_dataset(installed().tasks[task].spec, recordings)


Job = tuple[Cell, tuple[Path, ...], "BaseException | None"]
"""A cell, its recordings, and why there are none if the rig could not make them."""


def solve(job: Job, working: Callable[[str], None] | None = None) -> Answer:
    """Answer one cell. Never raises for what a plugin or a recording does."""
    cell, recordings, trouble = job
    registry = installed()
    if trouble is not None:
        row = opening(cell, registry.tasks[cell.task].spec)
        if isinstance(trouble, NotApplicable):
            return {**row, "status": "skipped", "reason": str(trouble)}, {}
        return failed(row, trouble), {}
    return answer(cell, registry, recordings, _dataset, working)
