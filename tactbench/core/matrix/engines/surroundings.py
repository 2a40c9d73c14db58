"""What a process computes with: two processes that agree in it give the same bytes for the same cell."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from tactbench.core.matrix.keys import RELEVANT, versions
from tactbench.core.matrix.source import SourceDigests, digest_of
from tactbench.core.plugins.registry import Registry


def sources_remembered(memory: str) -> SourceDigests:
    """Return digests of sources that are remembered in the file `memory`; nowhere if that is ""."""
    return SourceDigests(Path(memory) if memory else Path(os.devnull) / "nothing")


def surroundings(registry: Registry, sources: SourceDigests) -> dict[str, str]:
    """Return versions and digests of sources that may change a number, by a name for readers.

    Parameters
    ----------
    registry
        What is installed. A plugin that could not be loaded does not count, nor does a distribution that is missing.
    sources
        Digests of packages.
    """
    modules = {shelf.owned(one.name).module for shelf in registry.shelves().values() for one in shelf}
    modules |= {one.where for one in registry.estimators}
    behind = sources.behind(modules, "answer")
    found = {f"the source of {package}": digest_of(files) for package, files in sorted(behind.packages.items())}
    found |= {f"the version of {name}": version for name, version in sorted(behind.versions.items())}
    more = {name for estimator in registry.estimators for name in estimator.distributions} - set(RELEVANT)
    for name, version in versions(tuple(sorted(more))).items():
        if version != "missing":
            found[f"the version of {name}"] = version
    return found


def differences(here: Mapping[str, str], there: Mapping[str, str]) -> list[str]:
    """Return what `there` has otherwise than `here`, one clause for each; what only `there` has does not matter."""
    return [_clause(name, value, there.get(name)) for name, value in here.items() if there.get(name) != value]


def _clause(name: str, here: str, there: str | None) -> str:
    if there is None:
        return f"{name.removeprefix('the ')} is missing there"
    if name.startswith("the version"):
        return f"{name} is {there} there and {here} here"
    return f"{name} differs"
