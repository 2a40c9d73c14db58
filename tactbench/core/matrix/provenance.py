"""Who computed this, with what, where: gathered once a run."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import tactbench


def host_id() -> str:
    """Return a digest that tells hosts apart without naming them."""
    parts = (platform.node(), platform.machine(), _cpu_model(), str(os.cpu_count()))
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]


def gather() -> dict[str, Any]:
    """Return versions, machine and commit.

    Notes
    -----
    The versions of all distributions take about 30 ms and the commit two calls of git: once a run, never once a cell.
    """
    return {
        "tactbench": tactbench.__version__,
        "python": sys.version.split()[0],
        "platform": platform.platform(),
        "machine": platform.machine(),
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "host": host_id(),
        "commit": _commit(),
        "distributions": dict(sorted((dist.name, dist.version) for dist in distributions() if dist.name)),
    }


def _cpu_model() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def _commit() -> str:
    """Return the commit of the checkout that tactbench runs from, with ``+`` for uncommitted changes."""
    package = Path(tactbench.__file__).parent
    if not (package.parent / ".git").exists():
        return ""
    try:
        head = _git(package, "rev-parse", "HEAD")
        dirty = _git(package, "status", "--porcelain", "--untracked-files=no", "--", ".")
    except (OSError, subprocess.SubprocessError):
        return ""
    return head[:12] + ("+" if dirty else "")


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=5, check=True)
    return done.stdout.strip()
