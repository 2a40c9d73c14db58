"""Which files make a package, however it was installed."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple


class SourceFile(NamedTuple):
    """One file of a package."""

    name: str
    """Its path inside the package, with slashes."""
    path: str
    stat: os.stat_result


def package_of(module: str) -> str:
    """Return the top-level package of ``package.module:attribute``."""
    return module.partition(":")[0].partition(".")[0]


def files_of(package: str) -> list[SourceFile]:
    """Return the files of an importable top-level package, sorted by name; none if it cannot be found.

    Notes
    -----
    Every file counts: modules, compiled extensions, tables and weights lying beside them. Left out are byte code
    (``__pycache__``) and what is hidden (``.name``). Of a package in several places (a namespace package, whoever
    installed the portions) all portions count; of an archive the whole archive; of a single module that module. Nothing
    is imported.
    """
    spec = _spec(package)
    if spec is None:
        return []
    archive = getattr(spec.loader, "archive", None)
    if archive is not None:
        return _single(package, archive)
    if spec.submodule_search_locations is None:
        return _single(Path(spec.origin).name, spec.origin) if spec.origin else []
    found = [file for root in dict.fromkeys(spec.submodule_search_locations) for file in _below(root, "", ())]
    return sorted(found, key=lambda file: (file.name, file.path))


def location_of(package: str) -> Path | None:
    """Return the folder that an importable top-level package lies in; None if it cannot be found on a disk."""
    spec = _spec(package)
    if spec is None:
        return None
    places = list(spec.submodule_search_locations or ()) or [spec.origin or ""]
    return Path(places[0]).parent if places[0] and Path(places[0]).exists() else None


def is_known(package: str) -> bool:
    """Return whether something of this name could be imported."""
    return _spec(package) is not None


def _spec(package: str) -> importlib.machinery.ModuleSpec | None:
    try:
        return importlib.util.find_spec(package)
    except (ImportError, ValueError, AttributeError):
        return None


def _single(name: str, path: str) -> list[SourceFile]:
    try:
        return [SourceFile(name, path, Path(path).stat())]
    except OSError:
        return []


def _below(folder: str, prefix: str, above: tuple[tuple[int, int], ...]) -> Iterator[SourceFile]:
    """Yield the files below a folder; a link that leads back to where it came from is not followed."""
    try:
        entries = list(os.scandir(folder))
        own = Path(folder).stat()
    except OSError:
        return  # a place that an editable install's finder made up, or one that may not be read
    here = (own.st_dev, own.st_ino)
    if here in above:
        return
    for entry in entries:
        if entry.name.startswith(".") or entry.name == "__pycache__":
            continue
        try:
            if entry.is_dir():
                yield from _below(entry.path, f"{prefix}{entry.name}/", (*above, here))
            elif entry.is_file():
                yield SourceFile(prefix + entry.name, entry.path, entry.stat())
        except OSError:
            continue
