"""Cells on a Dask cluster: a client of `distributed`; a worker carries out each cell in a process pool of its own."""

from __future__ import annotations

import logging
import math
import multiprocessing
import os
import pickle
import socket
import time
import uuid
import warnings
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryDirectory
from typing import Any

from distributed import Client, KilledWorker, LocalCluster, Reschedule, WorkerPlugin, get_worker  # noqa: TID253 (an extra)
from distributed.comm.addressing import get_address_host_port  # noqa: TID253
from distributed.core import Status  # noqa: TID253
from distributed.versions import VersionMismatchWarning  # noqa: TID253

from tactbench.core.errors import Crashed, EngineError, UsageError
from tactbench.core.matrix.evaluate_cell import in_folder
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.message import dump_error, load_error, pack, unpack
from tactbench.core.pool.pool import Pool, R, T
from tactbench.core.pool.processes import interrupts_blocked, set_subreaper
from tactbench.core.provenance.source import RELEVANT, SourceDigests, digest_of, versions

CONNECT_S = 10.0
"""Seconds that a scheduler may take to answer."""
GATHER_S = 10.0
"""Seconds that the first worker may take to appear."""
POLL_S = 0.5
"""Seconds between two looks at a scheduler from which nothing comes."""
ALONE_S = 60.0
"""Seconds that a run waits for a worker when the last one has gone."""
MOST = 3
"""Differences between two environments that a message names."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Dask:
    """The engine; it connects when there is something to do.

    Parameters
    ----------
    jobs
        Workers to start where there is no address; each carries out one cell at a time.
    limits
        What a cell may take.
    scheduler
        Address, as ``tcp://HOST:8786``; None: a scheduler and workers on this machine.
    alone_s
        How long to wait for a worker when the last one has gone.
    """

    def __init__(self, jobs: int, limits: Limits, scheduler: str | None = None, *, alone_s: float = ALONE_S) -> None:
        self._jobs, self._limits, self._scheduler, self._alone_s = jobs, limits, scheduler, alone_s

    def each(self, work: Callable[..., R], items: Iterable[T]) -> Generator[tuple[T, R | BaseException], None, None]:
        """Yield every item with its result, or with what stopped it, in the order in which they end.

        Parameters
        ----------
        work
            Called with an item and `concurrency`, the cells that may be at work at once on the machine.

        Raises
        ------
        UsageError
            Before anything is computed: if there is no worker, or one whose environment differs from this one's.
        """
        every = list(items)
        if not every:
            return
        with client_of(self._scheduler, self._jobs) as client, _same_environment(client):
            killers: list[T] = []
            for item, outcome in self._round(client, work, every):
                if isinstance(outcome, KilledWorker):
                    killers.append(item)
                else:
                    yield item, outcome
            for item in killers:  # now alone, so that it is known which cell ends workers
                ((_, outcome),) = self._round(client, work, [item])
                if isinstance(outcome, KilledWorker):
                    outcome = Crashed(
                        "Workers ended over this cell again and again, at last with no other cell at work.",
                        hint="The cell, or a plugin it loads, ends processes other than its own.",
                    )
                yield item, outcome

    def _round(self, client: Any, work: Callable[..., R], items: Sequence[T]) -> Iterator[tuple[T, Any]]:
        """Submit `items`, twice as many at a time as may be at work; yield each with what came of it."""
        ended: SimpleQueue[str] = SimpleQueue()
        waiting, pending = deque(items), dict[str, tuple[T, Any]]()
        looked, seen = -math.inf, time.monotonic()
        try:
            while waiting or pending:
                if time.monotonic() - looked > POLL_S and client.status == "running":
                    looked = time.monotonic()
                    workers = client.scheduler_info(n_workers=-1)["workers"]
                    on_host = _concurrency(workers, len(items))
                    seen = looked if workers else seen
                elif client.status == "closed" or time.monotonic() - seen > self._alone_s:
                    break
                room = 2 * sum(int(facts["nthreads"]) for facts in workers.values()) - len(pending)
                for item in [waiting.popleft() for _ in range(min(room, len(waiting)))]:
                    try:
                        request = pickle.dumps((work, item, str(Path.cwd()), self._limits, on_host))
                    except Exception as error:
                        yield item, EngineError(f"The cell cannot be sent to a worker: {error}.")
                        continue
                    key = f"cell-{uuid.uuid4().hex}"
                    future = client.submit(carry_out, request, key=key, pure=False)
                    pending[key] = item, future
                    future.add_done_callback(lambda done: ended.put(done.key))
                with suppress(Empty):
                    item, future = pending.pop(ended.get(timeout=POLL_S))
                    outcome = self._outcome(client, future)
                    future.release()  # here, and not by its destructor: there a Ctrl-C would be lost
                    yield item, outcome
            for item in (*(item for item, _ in pending.values()), *waiting):
                yield item, self._lost(client)
        finally:
            if pending and client.status == "running":
                with suppress(OSError, TimeoutError):
                    client.cancel([future for _, future in pending.values()], force=True)

    def _outcome(self, client: Any, future: Any) -> Any:
        try:
            if future.status == "finished":
                message = unpack(future.result(timeout=CONNECT_S))
                return load_error(message["error"]) if "error" in message else message["value"]
            error = future.exception(timeout=CONNECT_S) if future.status == "error" else None
        except Exception as lost:
            return EngineError(f"What a Dask worker computed did not arrive: {lost!r}.")
        if isinstance(error, KilledWorker):
            return error
        return self._lost(client) if error is None else EngineError(f"A Dask worker could not pass it on: {error!r}.")

    def _lost(self, client: Any) -> EngineError:
        what = f"has had no worker for {self._alone_s:.0f} s" if client.status == "running" else "went away"
        return EngineError(
            f"The Dask scheduler at {client.scheduler.address} {what} before this cell was computed.",
            hint="Start it, or workers for it, and give the same command again: what was finished is kept.",
        )


# On a worker


def carry_out(request: bytes) -> bytes:
    """Carry out one cell in a child process of this worker; return what came of it as JSON and arrays."""
    worker = get_worker()
    agreed: Any = worker.plugins[SameEnvironment.name]
    if agreed.differs:
        raise Reschedule
    key = worker.get_current_task()
    work, item, folder, limits, on_host = pickle.loads(request)

    def is_needed() -> bool:
        task = worker.state.tasks.get(key)
        at_work = worker.status in (Status.running, Status.paused)  # it closes when the scheduler has gone
        return at_work and task is not None and task.state != "cancelled"

    concurrency = on_host.get(worker.address, worker.state.nthreads)
    pool = Pool(1, limits, is_needed=is_needed)
    for _, outcome in pool.each(partial(in_folder, folder, concurrency, work), [item]):
        if isinstance(outcome, BaseException):
            return pack({"error": dump_error(outcome)})
        return pack({"value": outcome})
    return pack({"error": dump_error(EngineError("Nobody waits for this cell any more."))})


class SameEnvironment(WorkerPlugin):
    """Refuses a worker whose versions or sources differ from the run's; prepares others for having child processes.

    One that is there when the plugin is registered stays, and the run is refused; one that comes later is closed.

    Parameters
    ----------
    expected
        The run's environment.
    threads
        Environment variables that hold numerical libraries at a number of threads.
    there
        Addresses of the workers that are there.
    """

    name = "tactbench-environment"

    def __init__(self, expected: Mapping[str, str], threads: Mapping[str, str], there: Sequence[str]) -> None:
        self._expected, self._threads, self._there = expected, threads, there
        self.differs = True

    def setup(self, worker: Any) -> None:
        """Compare the environments; raise UsageError if they differ."""
        multiprocessing.current_process().daemon = False  # a daemon of `multiprocessing` may have no children
        os.environ.update(self._threads)
        set_subreaper(True)  # what a crashed cell leaves behind becomes a child of this process, and is ended
        found = differences(self._expected, environment(installed()))
        self.differs = bool(found)
        if found:
            more = f"; and {len(found) - MOST} more" if len(found) > MOST else ""
            why = f"The Dask worker at {worker.address} cannot be used: {'; '.join(found[:MOST])}{more}."
            if worker.address not in self._there:
                worker.loop.add_callback(worker.close, reason=why)
            raise UsageError(why, hint="Start workers in the environment of this run, and stop the others.")


def environment(registry: Registry) -> dict[str, str]:
    """Return versions and digests of sources that may change a number, by a name for readers.

    A plugin that could not be loaded does not count, nor does a distribution that is missing.
    """
    modules = {family.owned(one.name).module for family in registry.families().values() for one in family}
    modules |= {one.where for one in registry.estimators}
    behind = SourceDigests().behind(modules, "answer")
    found = {f"the source of {package}": digest_of(files) for package, files in sorted(behind.packages.items())}
    found |= {f"the version of {name}": version for name, version in sorted(behind.versions.items())}
    more = {name for estimator in registry.estimators for name in estimator.distributions} - set(RELEVANT)
    for name, version in versions(tuple(sorted(more))).items():
        if version != "missing":
            found[f"the version of {name}"] = version
    return found


def differences(here: Mapping[str, str], there: Mapping[str, str]) -> list[str]:
    """Return what `there` has otherwise than `here`, one clause for each; what only `there` has does not matter."""
    found = {name: there.get(name, "missing") for name in here}
    return [f"{name} is {found[name]} there and {here[name]} here" for name in here if found[name] != here[name]]


# The client's side


@contextmanager
def _same_environment(client: Any) -> Iterator[None]:
    """Keep workers of other environments out while the context lasts: those that are there, and those that come."""
    try:
        client.wait_for_workers(1, timeout=GATHER_S)
    except TimeoutError as error:
        where = client.scheduler.address
        raise UsageError(
            f"The Dask scheduler at {where} has no worker.", hint=f"Start some with `dask worker {where}`."
        ) from error
    threads = {name: os.environ[name] for name in _THREADS if name in os.environ}
    try:
        there = list(client.scheduler_info(n_workers=-1)["workers"])
        client.register_plugin(SameEnvironment(environment(installed()), threads, there))
        yield
    finally:
        if client.status == "running":
            with suppress(Exception):
                client.unregister_worker_plugin(SameEnvironment.name)


def _concurrency(workers: Mapping[str, Any], cells: int) -> dict[str, int]:
    """Return how many cells may be at work at once on the machine of each worker, by the worker's address."""
    on_host: Counter[str] = Counter()
    for facts in workers.values():
        on_host[str(facts.get("host"))] += int(facts["nthreads"])
    return {address: min(on_host[str(facts.get("host"))], cells) for address, facts in workers.items()}


def check_scheduler(address: str | None) -> None:
    """Make sure that something listens at `address`, if one is given; starts no thread.

    Raises
    ------
    UsageError
        If the address makes no sense, or nothing answers there within `CONNECT_S`.
    """
    if address is None:
        return
    try:
        host, port = get_address_host_port(address)
    except ValueError as error:
        raise UsageError(
            f"{address!r} is no address of a Dask scheduler: {error}.", hint="Give one like tcp://HOST:8786."
        ) from error
    try:
        socket.create_connection((host, port), timeout=CONNECT_S).close()
    except OSError as error:
        raise _unreachable(address, error.strerror or str(error)) from error


@contextmanager
def client_of(address: str | None, jobs: int) -> Iterator[Any]:
    """Open a client of the scheduler at `address`, or of a cluster of `jobs` workers of one thread each here.

    Raises
    ------
    UsageError
        If the scheduler does not answer within `CONNECT_S`.
    """
    import dask

    with TemporaryDirectory(prefix="tactbench-dask-") as scratch, ExitStack() as stack:
        settings = {
            "temporary-directory": scratch,
            "distributed.scheduler.allowed-failures": 1,
            "distributed.diagnostics.nvml": False,
            "distributed.worker.profile.enabled": False,
        }
        stack.enter_context(_quiet())
        stack.enter_context(dask.config.set(settings))
        to = stack.enter_context(_local_cluster(jobs)) if address is None else address
        try:
            with warnings.catch_warnings():
                # Versions that may change a number are compared by us; others do not matter.
                warnings.simplefilter("ignore", VersionMismatchWarning)
                client = Client(to, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, ImportError) as error:
            raise _unreachable(str(to), str(error)) from error
        try:
            yield client
        finally:
            with suppress(OSError, TimeoutError):
                client.close(timeout=CONNECT_S)


@contextmanager
def _local_cluster(jobs: int) -> Iterator[LocalCluster]:
    """Start a scheduler and `jobs` workers on the loopback; leave no process, and the environment as it was."""
    before = dict(os.environ)  # nannies set variables for the workers that they start
    resource_tracker.ensure_running()  # it lets interrupts in again where it is started: before
    with interrupts_blocked():
        cluster = LocalCluster(
            n_workers=jobs, threads_per_worker=1, processes=True, host="127.0.0.1", memory_limit=0,
            dashboard_address=None, scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
            silence_logs=logging.CRITICAL + 1,
        )  # fmt: skip
    try:
        yield cluster
    finally:
        with interrupts_blocked():
            cluster.close(timeout=CONNECT_S)
        for name in set(os.environ) - set(before):
            del os.environ[name]
        os.environ.update(before)


def _unreachable(address: str, why: str) -> UsageError:
    return UsageError(
        f"No Dask scheduler answers at {address}: {why}.",
        hint="Start one with `dask scheduler` and give --scheduler the address it prints, or leave --scheduler out for "
        "workers on this machine.",
    )


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the library's log off the screen: what a user must know, rows and errors of ours say."""
    logging.disable()
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)
