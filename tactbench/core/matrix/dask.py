"""Engine that evaluates cells on a Dask cluster, with the same function as the local engines.

Workers need the versions and sources of this run, and its files at the same paths. A worker evaluates each cell in a
child process, within the same limits.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dask import config  # noqa: TID253  (imported for this engine alone)
from distributed import Client, KilledWorker, LocalCluster, as_completed  # noqa: TID253
from distributed.versions import VersionMismatchWarning  # noqa: TID253

from tactbench.core.errors import Crashed, EngineError, UsageError, error_text
from tactbench.core.interrupts import interrupts_held
from tactbench.core.matrix.keys import differences
from tactbench.core.matrix.solve import Job, check_content
from tactbench.core.plugins.registry import installed
from tactbench.core.pool import Engine, Limits, Pool, preload
from tactbench.core.pool.child import plain_error
from tactbench.core.provenance import ANSWERING, sources_of, versions
from tactbench.core.thread_limit import VARIABLES

CONNECT_S = 10.0
"""Time limit for connecting to the scheduler [s]."""
GATHER_S = 60.0
"""Time limit for the first worker to connect [s]."""


class Dask(Engine):
    """Engine on a Dask cluster; it connects on entering its context.

    Parameters
    ----------
    jobs
        Number of workers to start if there is no address; each evaluates one cell at a time.
    limits
        Limits of time and memory of a cell.
    scheduler
        Address of the scheduler, as ``tcp://HOST:8786``; None: start a scheduler and workers on this machine.
    """

    def __init__(self, jobs: int, limits: Limits, scheduler: str | None) -> None:
        super().__init__()
        self._jobs, self._limits, self._scheduler = jobs, limits, scheduler

    def __enter__(self) -> Dask:
        """Connect to the scheduler, or start a local cluster.

        Raises
        ------
        UsageError
            If no scheduler responds, or the versions or sources of a worker differ from those of this run.
        """
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        threads = {name: os.environ.get(name, "1") for name in VARIABLES}
        with ExitStack() as stack:
            to: Any = self._scheduler
            if to is None:
                place = stack.enter_context(TemporaryDirectory(prefix="tactbench-dask-", ignore_cleanup_errors=True))
                settings = config.set({"temporary-directory": place})
                with interrupts_held(), _without_interrupts(), settings:
                    to = stack.enter_context(LocalCluster(
                        n_workers=self._jobs, threads_per_worker=1, host="127.0.0.1", memory_limit=0,
                        dashboard_address=None, silence_logs=logging.CRITICAL,
                    ))  # fmt: skip
            try:
                with warnings.catch_warnings():  # versions that may change a number are compared below
                    warnings.simplefilter("ignore", VersionMismatchWarning)
                    self._client = stack.enter_context(Client(to, timeout=CONNECT_S, set_as_default=False))
                self._client.wait_for_workers(1, timeout=GATHER_S)
            except (OSError, ValueError) as error:
                raise UsageError(
                    f"No Dask scheduler with a worker responds at {self._scheduler}: {error}.",
                    hint="Start `dask scheduler` and `dask worker ADDRESS`, or unset DASK_SCHEDULER_ADDRESS.",
                ) from error
            for address, there in self._client.run(_prepared, threads).items():
                if differ := differences(environment(), there):
                    raise UsageError(
                        f"The Dask worker at {address} differs from this run (here -> there): {'; '.join(differ[:3])}.",
                        hint="Start workers in the environment of this run, and stop the others.",
                    )
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Disconnect from the cluster; cells in progress are cancelled."""
        with interrupts_held():
            super().__exit__()
            self._stack.close()

    def outcomes(self) -> Iterator[tuple[Any, Any]]:
        """Yield every cell with its result or the error that stopped it, in the order in which they end."""
        folder = str(Path.cwd())
        of = {
            self._client.submit(carry_out, work, job, folder, self._limits, pure=False, retries=0): job
            for work, jobs in self._waiting
            for job in jobs
        }
        self._waiting.clear()
        for future in as_completed(list(of), loop=self._client.loop, raise_errors=False):
            try:
                yield of[future], future.result()
            except KilledWorker as error:
                yield of[future], Crashed(f"Workers ended while evaluating the cell: {error}.")
            except Exception as error:
                lost = EngineError(
                    f"The Dask cluster did not evaluate the cell: {error_text(error)}.",
                    hint="Give the same command again: finished cells are kept.",
                )
                yield of[future], lost


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Return a context in which started processes ignore Ctrl-C at the terminal, since the run ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # which would let them through in the thread that starts it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def carry_out(work: Callable[[Any], Any], job: Job, folder: str, limits: Limits) -> Any:
    """Evaluate one cell in a child process of this worker; return its result or the error that stopped it."""
    try:
        os.chdir(folder)
        check_content(job)
    except Exception as error:
        return plain_error(error)
    ((_, outcome),) = Pool(1, limits).each(work, [job])
    return outcome


def _prepared(threads: Mapping[str, str]) -> dict[str, str]:
    """Prepare a worker for starting child processes, and return its versions and digests of sources."""
    multiprocessing.current_process().daemon = False  # a daemon of `multiprocessing` may have no children
    preload("tactbench.core.matrix.preloaded")
    os.environ.update(threads)
    return environment()


def environment() -> dict[str, str]:
    """Return the versions and source digests, by name, that may change a result."""
    registry = installed()
    modules = [owner.module for family in (registry.tasks, registry.estimators) for owner in family.all_owned()]
    return {**versions(), **sources_of(modules, ANSWERING)}
