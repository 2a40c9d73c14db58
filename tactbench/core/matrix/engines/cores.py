"""Cores: how many this process may use, and how many somebody wants."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def wanted() -> int:
    """Return how many processes and threads of the whole machine are at work or wait for a core, this one included.

    It is 1 where the system does not tell.
    """
    with suppress(OSError, ValueError, IndexError):
        return int(Path("/proc/loadavg").read_bytes().split()[3].partition(b"/")[0])  # proc_loadavg(5)
    return 1
