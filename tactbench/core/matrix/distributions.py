"""Which distribution an installed package came with, and which version that is."""

from __future__ import annotations

import re
import sysconfig
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

from tactbench.core.matrix.remembered import FileMemory

_SHARED = frozenset({"site-packages", "dist-packages"})


def is_installed(place: Path) -> bool:
    """Return whether `place` is a folder that packages are installed into, not somebody's working folder."""
    return place.name in _SHARED or place in _installation()


@lru_cache(maxsize=1)
def _installation() -> frozenset[Path]:
    return frozenset(Path(path) for name, path in sysconfig.get_paths().items() if name in ("purelib", "platlib"))


def normal(name: str) -> str:
    """Return the name of a distribution as PEP 503 compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


class Distributions:
    """Versions of installed packages, looked up in the folder they lie in.

    Parameters
    ----------
    memory
        Remembers what was found in a folder until something is installed there or removed.
    """

    def __init__(self, memory: FileMemory) -> None:
        self._memory = memory

    def version_of(self, package: str, place: Path) -> str | None:
        """Return ``name version`` of the distributions that brought `package` to `place`; None if none says so."""
        try:
            stat = place.stat()
        except OSError:
            return None
        facts = self._memory.facts(stat)
        if package not in facts:
            found = sorted(f"{name} {version}" for name, version, folder in _in(place) if _brings(folder, package))
            facts = {package: ", ".join(found) or None}
            self._memory.learn(stat, stat, facts)
        return facts[package]


def _in(place: Path) -> Iterator[tuple[str, str, Path]]:
    """Yield name, version and the folder that says so; wheels have it in the folder's name, old ways in a file."""
    for folder in place.glob("*.dist-info"):
        name, _, version = folder.name.removesuffix(".dist-info").partition("-")
        if version:
            yield normal(name), version, folder
    for folder in place.glob("*.egg-info"):
        try:
            said = (folder / "PKG-INFO").read_text(encoding="utf-8")
        except (OSError, ValueError):
            continue
        found = dict(re.findall(r"^(Name|Version): *(\S+)$", said, re.MULTILINE))
        if len(found) == 2:
            yield normal(found["Name"]), found["Version"], folder


def _brings(folder: Path, package: str) -> bool:
    try:
        if package in (folder / "top_level.txt").read_text(encoding="utf-8").split():
            return True
    except (OSError, ValueError):
        pass
    try:
        record = (folder / "RECORD").read_text(encoding="utf-8")
    except (OSError, ValueError):
        return False
    return re.search(rf'^"?{re.escape(package)}(/|\.[^/\n]*(py|so|pyd),)', record, re.MULTILINE) is not None


def installed_distributions(paths: Iterable[str]) -> dict[str, str]:
    """Return name -> version of everything installed along `paths`, read off the names of the folders that say so."""
    found: dict[str, str] = {}
    for path in paths:
        for name, version, _ in _in(Path(path)) if path else ():
            found.setdefault(name, version)
    return dict(sorted(found.items()))
