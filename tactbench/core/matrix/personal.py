"""What this user's runs remember beyond one result folder: the digests of source files, which all of them share."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

from tactbench.core.matrix import distributions, meaning, source
from tactbench.core.matrix.remembered import FileMemory
from tactbench.core.matrix.source import SourceDigests

VARIABLE = "TACTBENCH_CACHE"
"""Moves the folder; set to nothing, nothing is remembered."""

_READERS = (distributions, meaning, source)
"""Whoever reads facts out of files: what another version of them has read is another memory's."""


def sources_of_this_user() -> SourceDigests:
    """Return digests of sources that a file of this user remembers; a file that is not his alone is not believed."""
    folder, readers = cache_folder(), _readers()
    if folder is None or readers is None:
        folder = Path(os.devnull)  # where there is nothing, and nothing can be written
    return SourceDigests(FileMemory(folder / f"sources-{readers}.json", personal=True))


def cache_folder() -> Path | None:
    """Return the folder for what only saves this user time, where the platform keeps such; it need not exist."""
    asked = os.environ.get(VARIABLE)
    if asked is not None:
        return Path(asked) if asked else None
    try:
        return _platforms_place() / "tactbench"
    except RuntimeError:  # no home
        return None


def _platforms_place() -> Path:
    if sys.platform == "win32":
        local = os.environ.get("LOCALAPPDATA")
        return Path(local) if local else Path.home() / "AppData" / "Local"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return named if named.is_absolute() else Path.home() / ".cache"


def _readers() -> str | None:
    """Return a digest of the code that reads facts out of files and of what Python it runs in; None if it is hidden."""
    total = hashlib.sha256(str(sys.implementation.cache_tag).encode())
    try:
        for module in _READERS:
            total.update(Path(str(module.__file__)).read_bytes())
    except OSError:  # in an archive
        return None
    return total.hexdigest()[:16]
