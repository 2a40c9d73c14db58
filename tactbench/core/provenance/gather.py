"""Provenance of a run: its software and machine, gathered once and shown below tables.

A provenance contains no time, path, or name of a person or host: equal circumstances give equal provenance.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.plugins.registry import Registry
from tactbench.core.provenance.source import PACKAGE, RELEVANT, source_digest, version_of
from tactbench.core.thread_limit import VARIABLES


def gather(registry: Registry, **circumstances: Any) -> dict[str, Any]:
    """Return versions, machine, commit, plugins, and the `circumstances` of the run, such as seed and engine."""
    return {
        "tactbench": tactbench.__version__,
        "commit": _commit(Path(tactbench.__file__).parent),
        "python": platform.python_version(),
        "platform": f"{platform.system()}-{platform.release()}-{platform.machine()}",
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "host": host_id(),
        "threads": next((os.environ[name] for name in VARIABLES if name in os.environ), "1"),
        "plugins": list(_plugins(registry)),
        "distributions": {name: version_of(name) for name in RELEVANT},
        **circumstances,
    }


def usable_cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def host_id() -> str:
    """Return a digest of 12 hexadecimal digits that identifies the host without its name."""
    parts = (platform.node(), platform.machine(), cpu_model(), str(os.cpu_count()))
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]


@cache
def cpu_model() -> str:
    """Return the model name of the processor, or "unknown"."""
    with suppress(OSError):
        found = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
        if found:
            return found[1]
    return platform.processor() or "unknown"


def _plugins(registry: Registry) -> Iterator[dict[str, str]]:
    """Yield distribution, version, package and source digest of each package with third-party plugins."""
    packages = {row.module.partition(".")[0]: row for row in registry.plugins}
    for package, row in sorted(packages.items()):
        if package != PACKAGE:
            source = source_digest(package)
            yield {"distribution": row.distribution, "version": row.version, "package": package, "source": source}


def _commit(folder: Path) -> str:
    """Return the git commit of the checkout that contains `folder`, with ``+changes`` if files differ from it."""
    command = ["git", "-C", str(folder), "describe", "--always", "--abbrev=12", "--exclude=*", "--dirty=+changes"]
    with suppress(OSError, subprocess.SubprocessError):
        return subprocess.check_output(command, stderr=subprocess.DEVNULL, text=True).strip()
    return ""
