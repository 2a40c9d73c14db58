"""Limits on time and memory of an item of work, and the measurement of memory."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import psutil


@dataclass(frozen=True)
class Limits:
    """Limits of one item, a cell or a recording; None means no limit."""

    timeout_s: float | None = None
    """Seconds of wall time."""
    memory_mb: int | None = None
    """MB (2**20 bytes) beyond what its process holds when the item begins."""
    grace_s: float = 0.0
    """Seconds between SIGTERM and SIGKILL, so that a rig can close its devices."""


UNLIMITED = Limits()


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process and its descendants, MB; 0 once it has ended."""
    total = 0
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                total += one.memory_info().rss
    return total / 2**20
