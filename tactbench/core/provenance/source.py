"""Digests of source code: the bytes of a plugin's package, the versions or bytes of the packages that it imports.

A plugin's whole package counts, not its one module: a changed module or table beside it changes what it computes. So do
the packages it imports: their version if they were installed, their source if they lie in somebody's working folder.
"""

from __future__ import annotations

import ast
import importlib.machinery
import importlib.util
import os
import re
import sys
import sysconfig
import uuid
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

from tactbench.core.files import sha256

Purpose = Literal["recording", "answer"]

PACKAGE = "tactbench"
_DOORS = frozenset({"tactbench", "tactbench.plugin", "tactbench.testing"})

SHOWING = (
    "core/choosing/", "core/cli/", "core/conformance/", "core/cost/", "core/leaderboard/",
    "core/report/", "core/statistics/", "core/tables/", "core/matrix/progress.py", "core/matrix/store",
    "core/provenance/", "__main__.py", "testing.py", "benchmarks.yaml", "matrices/",
)  # fmt: skip
"""Rooms of tactbench that show, keep or compare what was computed: a new colour in a table computes nothing again.
Of the core: the floors above the matrix, and the matrix's own keeping. In doubt, a room counts."""

_NOT_FOR: dict[Purpose, tuple[str, ...]] = {
    # Answers are made from recordings, whose bytes are in the key: how those came about is their own affair.
    "answer": ("sensors/", "rigs/", "links/", "devices/", "core/acquisition"),
    # Whoever records knows nothing of what is asked afterwards; the contracts of the imports hold it to that.
    "recording": ("tasks/", "estimators/", "core/evaluation/", "core/matrix/", "core/pool/"),
}


@dataclass(frozen=True)
class Source:
    """What the code behind something is."""

    packages: Mapping[str, Mapping[str, str]]
    """Digest of each file, by package."""
    versions: Mapping[str, str]
    """Versions of the distributions that those packages import."""


class SourceDigests:
    """Digests of packages, each looked at once in the life of this object."""

    def __init__(self) -> None:
        self._packages: dict[tuple[str, tuple[str, ...]], tuple[dict[str, str], frozenset[str]]] = {}
        self._behind: dict[tuple[Purpose, frozenset[str]], Source] = {}

    def package(self, module: str) -> str:
        """Return one digest of the top-level package that holds `module`."""
        return digest_of(self._look_at(package_of(module))[0])

    def behind(self, modules: Iterable[str], purpose: Purpose) -> Source:
        """Return the code behind `modules` (``package.module`` or ``package.module:attribute``), tactbench's included.

        A package that nobody can find has a digest that never comes twice: what it makes is not used again.
        """
        roots = frozenset(modules)
        if (purpose, roots) not in self._behind:
            self._behind[purpose, roots] = self._follow(roots, purpose)
        return self._behind[purpose, roots]

    def _follow(self, modules: frozenset[str], purpose: Purpose) -> Source:
        packages: dict[str, Mapping[str, str]] = {}
        versions: dict[str, str] = {}
        own_modules = {module.partition(":")[0] for module in modules if package_of(module) == PACKAGE}
        waiting = sorted({package_of(module) for module in modules} - {PACKAGE})
        while waiting:
            name = waiting.pop()
            if name in packages:
                continue
            packages[name], imported = self._look_at(name)
            own_modules |= {module for module in imported if package_of(module) == PACKAGE}
            for other in sorted(imported):
                if package_of(other) == PACKAGE or other in packages or other in versions:
                    continue
                place = location_of(other)
                if place is None:
                    versions[other] = "absent" if _spec(other) is None else "not a file"
                    continue
                version = _version_of(other, place) if is_installed(place) else None
                if version is None:
                    waiting.append(other)
                else:
                    versions[other] = version
        packages[PACKAGE] = self._own_files(purpose, own_modules - _DOORS)
        return Source(packages, versions)

    def _own_files(self, purpose: Purpose, used: set[str]) -> Mapping[str, str]:
        """Return tactbench's own files that count; every one if somebody uses rooms that otherwise would not."""
        left_out = (*SHOWING, *_NOT_FOR[purpose])
        rooms = [module.partition(".")[2].replace(".", "/") + "/" for module in used]
        beyond = any(room.startswith(left_out) or room == "core/" for room in rooms)
        return self._look_at(PACKAGE, () if beyond else left_out)[0]

    def _look_at(self, package: str, left_out: tuple[str, ...] = ()) -> tuple[dict[str, str], frozenset[str]]:
        if (package, left_out) not in self._packages:
            digests: dict[str, str] = {}
            imported: set[str] = set()
            for name, path in files_of(package):
                if left_out and name.startswith(left_out):
                    continue
                try:
                    content = Path(path).read_bytes()
                except OSError:
                    digests[_free(name, digests)] = f"unreadable {uuid.uuid4().hex}"
                    continue
                digests[_free(name, digests)] = sha256(content)[:32]
                if package != PACKAGE and name.endswith((".py", ".pyw")):
                    imported.update(imports_of(content))
            if not digests:
                digests["(its source cannot be found)"] = uuid.uuid4().hex
            self._packages[package, left_out] = digests, frozenset(imported) - {package} - sys.stdlib_module_names
        return self._packages[package, left_out]


def digest_of(facts: Mapping[str, str]) -> str:
    """Return one digest of a mapping, whatever its order."""
    text = "".join(f"{name}\0{facts[name]}\0" for name in sorted(facts))
    return sha256(text)[:32]


def _free(name: str, taken: Mapping[str, str]) -> str:
    """Return `name`, numbered where another portion of the package has a file of that name."""
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name} ({number})"
    return free


# What a file imports


def imports_of(content: bytes) -> list[str]:
    """Return the top-level packages that a file imports, sorted; of tactbench's own, the room: ``tactbench.rigs``.

    Also those of ``import_module("name")``; a name put together while the program runs cannot be seen.
    """
    try:
        nodes = list(ast.walk(ast.parse(content)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            # `from tactbench import rigs` names the room only in its list.
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and _imports(node.func) and node.args:
            first = node.args[0]
            if isinstance(first, ast.Constant) and isinstance(first.value, str) and not first.value.startswith("."):
                found.add(first.value)
    return sorted({_room(name) for name in found})


def _room(name: str) -> str:
    package, _, rest = name.partition(".")
    if package != PACKAGE or not rest:
        return package
    first, _, second = rest.partition(".")
    return f"{PACKAGE}.{first}" + (f".{second.partition('.')[0]}" if first == "core" and second else "")


def _imports(function: ast.expr) -> bool:
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    return name in ("import_module", "__import__")


# Which files make a package, however it was installed


def package_of(module: str) -> str:
    """Return the top-level package of ``package.module:attribute``."""
    return module.partition(":")[0].partition(".")[0]


def files_of(package: str) -> list[tuple[str, str]]:
    """Return name inside the package and path of every file of an importable top-level package, sorted.

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
        return [(package, archive)]
    if spec.submodule_search_locations is None:
        return [(Path(spec.origin).name, spec.origin)] if spec.origin else []
    return sorted(file for root in dict.fromkeys(spec.submodule_search_locations) for file in _below(root, "", ()))


def location_of(package: str) -> Path | None:
    """Return the folder that an importable top-level package lies in; None if it cannot be found on a disk."""
    spec = _spec(package)
    if spec is None:
        return None
    places = list(spec.submodule_search_locations or ()) or [spec.origin or ""]
    return Path(places[0]).parent if places[0] and Path(places[0]).exists() else None


def _spec(package: str) -> importlib.machinery.ModuleSpec | None:
    try:
        return importlib.util.find_spec(package)
    except (ImportError, ValueError, AttributeError):
        return None


def _below(folder: str, prefix: str, above: tuple[tuple[int, int], ...]) -> Iterator[tuple[str, str]]:
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
                yield prefix + entry.name, entry.path
        except OSError:
            continue


# Which distribution brought an installed package


def is_installed(place: Path) -> bool:
    """Return whether `place` is a folder that packages are installed into, not somebody's working folder."""
    return place.name in ("site-packages", "dist-packages") or place in _installation()


@lru_cache(maxsize=1)
def _installation() -> frozenset[Path]:
    return frozenset(Path(path) for name, path in sysconfig.get_paths().items() if name in ("purelib", "platlib"))


def normal(name: str) -> str:
    """Return the name of a distribution as PEP 503 compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _version_of(package: str, place: Path) -> str | None:
    """Return ``name version`` of the distributions that brought `package` to `place`; None if none says so."""
    found = sorted(f"{name} {version}" for name, version, folder in _in(place) if _brings(folder, package))
    return ", ".join(found) or None


def _in(place: Path) -> Iterator[tuple[str, str, Path]]:
    """Yield name, version and the folder that says so; wheels have it in the folder's name, old ways in a file."""
    for folder in place.glob("*.dist-info"):
        name, _, version = folder.name.removesuffix(".dist-info").partition("-")
        if version:
            yield normal(name), version, folder
    for folder in place.glob("*.egg-info"):
        try:
            text = (folder / "PKG-INFO").read_text(encoding="utf-8")
        except (OSError, ValueError):
            continue
        found = dict(re.findall(r"^(Name|Version): *(\S+)$", text, re.MULTILINE))
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


RELEVANT = ("numpy", "scipy", "scikit-learn")
"""Distributions whose version may change a number."""


@lru_cache(maxsize=8)
def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the versions that may change a number: Python's, those of `RELEVANT` and of the distributions `more`."""
    installed = installed_distributions(sys.path)
    found = {"python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    return found | {name: installed.get(normal(name), "missing") for name in (*RELEVANT, *more)}


def installed_distributions(paths: Iterable[str]) -> dict[str, str]:
    """Return name -> version of everything installed along `paths`, read off the names of the folders that say so."""
    found: dict[str, str] = {}
    for path in paths:
        for name, version, _ in _in(Path(path)) if path else ():
            found.setdefault(name, version)
    return dict(sorted(found.items()))
