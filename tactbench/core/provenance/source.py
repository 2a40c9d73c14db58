"""Digests of the source code of packages that take part in a recording or an answer."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import pickle
import pickletools
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

PACKAGE = "tactbench"
RELEVANT = ("numpy", "scipy", "scikit-learn")
"""Distributions whose version may change a number in any cell."""

_BOTH = ("core/spec", "core/recording", "core/samples", "core/plugins", "core/thread_limit")
ANSWERING = (*_BOTH, "core/evaluation", "core/events", "core/statistics", "core/matrix/solve", "tasks", "estimators")
"""Sub-packages of tactbench that take part in every answer. Those that record do not: recordings count by content."""
RECORDING = (*_BOTH, "core/acquisition", "links", "devices")
"""Sub-packages of tactbench that take part in every recording, beside those of the sensor and the rig."""


@lru_cache(maxsize=256)
def source_digest(package: str, below: str = "") -> str:
    """Return the digest of the files of an importable package, or of one module or sub-package `below` it.

    Every file counts by its place and bytes, tables and compiled modules among them; byte code and hidden files do not,
    nor verbs and checks of tactbench, which take part in nothing. Nothing is imported. A package without a folder or
    file on disk has the digest of its name.
    """
    sha = hashlib.sha256(f"{package} {below}".encode())
    spec = importlib.util.find_spec(package)
    left_out = {"__pycache__"} | ({"cli", "conformance"} if package == PACKAGE else set())
    roots = [] if spec is None else list(spec.submodule_search_locations or ([spec.origin] if spec.origin else []))
    for root in sorted({Path(root) / below for root in roots}):
        files = [root] if root.is_file() else [path for path in root.rglob("*") if path.is_file()]
        for path in sorted(files):
            place = path.relative_to(root)
            if not left_out.intersection(place.parts) and not any(part.startswith(".") for part in place.parts):
                sha.update(f"\0{place.as_posix()}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return sha.hexdigest()[:32]


def sources_of(modules: Iterable[str], own: Sequence[str]) -> dict[str, str]:
    """Return digests by package: the sub-packages `own` of tactbench, and what holds each of `modules`.

    Parameters
    ----------
    modules
        ``package.module`` or ``package.module:attribute``. Of tactbench the sub-package of two levels counts, such as
        ``rigs/twin``; of any other package the whole of it.
    own
        Places in tactbench, such as ``core/spec``.
    """
    places = {(PACKAGE, place) for place in own}
    for module in modules:
        package, *below = module.partition(":")[0].split(".")
        places.add((package, "/".join(below[:2]) if package == PACKAGE else ""))
    found = {}
    for package, place in sorted(places):
        folder = place if (Path(__file__).parents[2] / place).is_dir() else f"{place}.py"
        name = f"{package}.{place.replace('/', '.')}" if place else package
        found[name] = source_digest(package, folder if place else "")
    return found


@lru_cache(maxsize=64)
def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the versions of Python, of `RELEVANT` and of the distributions `more`."""
    found = {"python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    return found | {name: version_of(name) for name in (*RELEVANT, *more)}


def version_of(distribution: str) -> str:
    """Return the version of an installed distribution, or "missing"."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "missing"


def digest_of(text: str) -> str:
    """Return the digest of a text for a key or an identifier: 32 hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def identity_of(value: Any) -> dict[str, Any]:
    """Return the digest of an object's attributes, with versions and sources of the code that it uses.

    Parameters
    ----------
    value
        Estimators, functions, arrays or plain data. The version of an installed distribution stands for the source of
        its classes, the file of a script for those of the script, and all files of any other package for its own.

    Raises
    ------
    ValueError
        If the source cannot be determined: of lambdas, and of objects defined in a notebook or a function.
    """
    import joblib

    try:
        codes = pickletools.genops(pickle.dumps(value, 2, fix_imports=False))  # this one has modules as text
        modules = {str(argument).split()[0] for code, argument, _ in codes if code.name == "GLOBAL"}
        script = {name: Path(sys.modules[name].__file__ or "").read_bytes() for name in modules & {"__main__"}}
    except Exception as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error
    tops = {name.partition(".")[0] for name in modules - script.keys()} - sys.stdlib_module_names
    places = {top: Path(getattr(sys.modules[top], "__file__", None) or "").parts for top in tops}
    installed = {top for top, parts in places.items() if {"site-packages", "dist-packages"}.intersection(parts)}
    owners = _distributions()
    source = sources_of(tops - installed, ()) | {
        name: hashlib.sha256(text).hexdigest() for name, text in script.items()
    }
    of = tuple(sorted({owner for top in installed for owner in owners.get(top, ())}))
    return {"object": joblib.hash(value), "versions": versions(of), "source": source}


@lru_cache(maxsize=1)
def _distributions() -> Mapping[str, list[str]]:
    """Return the distributions that provide each importable package."""
    return importlib.metadata.packages_distributions()
