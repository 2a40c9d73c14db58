"""Who computed this, with what, where: gathered once a run, and said in a few sentences under a table.

There is no clock in it, no name of a person or host and no path: equal circumstances give equal provenance.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.provenance.checkout import checkout_of
from tactbench.core.provenance.machine import blas, container, cpu_model, host_id, memory_mb, system
from tactbench.core.provenance.source import (
    PACKAGE,
    RELEVANT,
    SourceDigests,
    installed_distributions,
    is_installed,
    location_of,
    package_of,
)

__all__ = ["foot", "gather", "host_id"]


def gather(sources: SourceDigests | None = None, **circumstances: Any) -> dict[str, Any]:
    """Return versions, machine, state of the code, and the `circumstances` of the run, such as seed and jobs.

    Parameters
    ----------
    sources
        Digests of the plugins' packages, if somebody has them already.

    Notes
    -----
    About 10 ms, half of it a call of git a checkout: once a run, never once a cell.
    """
    digests = sources or SourceDigests()
    return {
        "tactbench": tactbench.__version__,
        "commit": _state(Path(tactbench.__file__).parent),
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "platform": system(),
        "machine": platform.machine(),
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "memory_mb": memory_mb(),
        "container": container(),
        "host": host_id(),
        "blas": blas(),
        "plugins": list(_plugins(installed(), digests)),
        "distributions": installed_distributions(sys.path),
        **circumstances,
    }


def _plugins(registry: Registry, digests: SourceDigests) -> Iterator[dict[str, str]]:
    """Yield every package of a plugin that is not ours: who brought it, its version, its source and its commit."""
    packages = {package_of(row.module): row for row in registry.plugins}
    for package, row in sorted(packages.items()):
        if package == PACKAGE:
            continue
        place = location_of(package)
        yield {
            "distribution": row.distribution,
            "version": row.version,
            "package": package,
            "source": digests.package(package),
            "commit": _state(place) if place is not None and not is_installed(place) else "",
        }


def _state(folder: Path) -> str:
    checkout = checkout_of(folder)
    return "" if checkout is None else str(checkout)


def foot(several: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return what stands under a table: which software made it on which machine, each said once.

    Parameters
    ----------
    several
        What `gather` returned for each of the runs that the rows come from; keys may be missing.
    """
    texts = [*map(_software, several), *(text for one in several for text in _plugin_texts(one)), *map(_place, several)]
    hosts = {str(one["host"]) for one in several if one.get("host")}
    if len(hosts) > 1:
        texts.append(f"{len(hosts)} hosts: times of one are not to be compared with times of another.")
    return tuple(dict.fromkeys(text for text in texts if text))


def _software(one: Mapping[str, Any]) -> str:
    if "tactbench" not in one:
        return ""
    state, _, changes = str(one.get("commit", "")).partition("+")
    commit = f" ({state}{f', with changes {changes}' if changes else ''})" if state else ""
    installed_versions = one.get("distributions", {})
    libraries = [f"{name} {installed_versions[name]}" for name in RELEVANT if name in installed_versions]
    algebra = one.get("blas", {})
    if algebra.get("version"):
        libraries.append(f"BLAS {algebra.get('name')} {algebra['version']} (threads: {algebra.get('threads')})")
    return f"tactbench {one['tactbench']}{commit}, Python {one.get('python', '?')}, {', '.join(libraries)}."


def _plugin_texts(one: Mapping[str, Any]) -> Iterator[str]:
    for plugin in one.get("plugins", ()):
        state = plugin.get("commit") or f"source {str(plugin.get('source', ''))[:12]}"
        yield f"Plugin {plugin.get('distribution')} {plugin.get('version')} ({state})."


def _place(one: Mapping[str, Any]) -> str:
    if not one.get("host"):
        return ""
    facts = [str(one.get("cpu", "unknown processor")), f"{one.get('cores')} cores"]
    if one.get("memory_mb"):
        facts.append(f"{one['memory_mb'] / 1024:.0f} GiB")
    if one.get("container"):
        facts.append(f"in a container ({one['container']})")
    together = f"; {one['jobs']} cells at once" if one.get("jobs", 1) != 1 else ""
    return f"Host {one['host']}: {', '.join(facts)}{together}."
