"""How much time and memory an item of work may take, and how that is measured."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import psutil

MB = 2**20


@dataclass(frozen=True)
class Limits:
    """What one item, a cell or a recording, may take; None: no limit."""

    timeout_s: float | None = None
    """Seconds of wall time."""
    memory_mb: int | None = None
    """MB (2**20 bytes) beyond what its process holds when the item begins."""
    grace_s: float = 0.0
    """Seconds between SIGTERM and SIGKILL, so that a rig can close its devices."""


UNLIMITED = Limits()


def can_refuse_memory() -> bool:
    """Return whether the system can refuse memory to a process; without that, memory is only measured."""
    try:
        import resource
    except ImportError:
        return False
    return hasattr(resource, "RLIMIT_DATA") and hasattr(psutil.Process().memory_info(), "data")


@contextmanager
def data_limit(memory_mb: int | None) -> Iterator[None]:
    """Let this process allocate `memory_mb` more MB: beyond that Python raises MemoryError."""
    if memory_mb is None or not can_refuse_memory():
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = psutil.Process().memory_info().data + memory_mb * MB
    resource.setrlimit(resource.RLIMIT_DATA, (wanted if hard < 0 else min(wanted, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process and its descendants, MB; 0 once it has ended."""
    total = 0
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                total += one.memory_info().rss
    return total / MB
