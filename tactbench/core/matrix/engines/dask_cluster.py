"""Opening a Dask cluster: one of our own on this machine, or the scheduler somebody has started."""

from __future__ import annotations

import logging
import os
import socket
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import resource_tracker
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.matrix.pool.processes import interrupts_blocked

CONNECT_S = 10.0
"""How long a scheduler may take to answer."""
_LOUD = ("distributed", "distributed.client", "distributed.gc", "tornado", "tornado.application", "asyncio")


def import_distributed() -> Any:
    """Return the library.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        import distributed
    except ImportError as error:
        raise UsageError(
            f"The Dask engine needs the library distributed, which cannot be imported ({error}).",
            hint="Install it with: pip install 'tactbench[dask]'.",
        ) from error
    return distributed


def check_scheduler(address: str | None) -> None:
    """Make sure that the library is there, and a scheduler at `address` if one is given; starts no thread.

    Raises
    ------
    UsageError
        If the library is missing, the address makes no sense, or nothing listens there within `CONNECT_S`.
    """
    import_distributed()
    if address is None:
        return
    from distributed.comm.addressing import get_address_host_port

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
def client_of(address: str | None, jobs: int) -> Iterator[tuple[Any, Path]]:
    """Open a client of the scheduler at `address`, or of a cluster of `jobs` workers of our own.

    With it comes a folder for what is worth nothing afterwards.

    Raises
    ------
    UsageError
        If the library is missing or the scheduler does not answer within `CONNECT_S`.
    """
    import_distributed()
    import dask

    with TemporaryDirectory(prefix="tactbench-dask-") as scratch, ExitStack() as stack:
        quick = {"distributed.diagnostics.nvml": False, "distributed.worker.profile.enabled": False}
        stack.enter_context(_quiet())
        stack.enter_context(_environment_kept())
        stack.enter_context(dask.config.set({"temporary-directory": scratch, **quick}))
        to = stack.enter_context(_own_cluster(jobs)) if address is None else address
        yield stack.enter_context(_connected(to)), Path(scratch)


@contextmanager
def _own_cluster(jobs: int) -> Iterator[Any]:
    """Start a scheduler and `jobs` workers of one thread each on the loopback; leave no process."""
    resource_tracker.ensure_running()  # it lets interrupts in again where it is started: let that be before
    with interrupts_blocked():
        # What cells take is watched by the engine; the workers themselves only pass requests on.
        cluster = import_distributed().LocalCluster(
            n_workers=jobs, threads_per_worker=1, processes=True, host="127.0.0.1", memory_limit=0,
            dashboard_address=None, scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
            silence_logs=logging.CRITICAL + 1,
        )  # fmt: skip
    try:
        yield cluster
    finally:
        with interrupts_blocked():
            cluster.close(timeout=CONNECT_S)


@contextmanager
def _connected(to: Any) -> Iterator[Any]:
    from distributed.versions import VersionMismatchWarning

    try:
        with warnings.catch_warnings():
            # Versions that may change a number are compared by us; others only where they keep processes from talking.
            warnings.simplefilter("ignore", VersionMismatchWarning)
            client = import_distributed().Client(to, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, ImportError) as error:
        raise _unreachable(str(to), str(error)) from error
    try:
        yield client
    finally:
        with suppress(OSError, TimeoutError):
            client.close(timeout=CONNECT_S)


def _unreachable(address: str, why: str) -> UsageError:
    return UsageError(
        f"No Dask scheduler answers at {address}: {why}.",
        hint="Start one with `dask scheduler` and give --scheduler the address it prints, or leave --scheduler out for "
        "workers on this machine.",
    )


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the library's log off the screen: what a user must know, rows and errors of ours say."""
    before = {name: logging.getLogger(name).level for name in _LOUD}
    for name in before:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def _environment_kept() -> Iterator[None]:
    """Take back what nannies set in this process's environment for the workers they start."""
    before = dict(os.environ)
    try:
        yield
    finally:
        for name in set(os.environ) - set(before):
            del os.environ[name]
        os.environ.update(before)
