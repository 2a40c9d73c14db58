"""Provenance of results: digests of source code, versions of software, and the machine.

A provenance contains no time, path, or name of a person or host: equal circumstances give equal provenance.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import os
import pickle
import pickletools
import platform
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.plugins.registry import Registry
from tactbench.core.thread_limit import VARIABLES

PACKAGE = "tactbench"
RELEVANT = ("numpy", "scipy", "scikit-learn")
"""Distributions whose version may change the result of any cell."""

_BOTH = ("core/spec", "core/recording", "core/samples", "core/plugins", "core/thread_limit")
ANSWERING = (*_BOTH, "core/evaluation", "core/events", "core/statistics", "core/matrix/solve", "tasks", "estimators")
"""Parts of tactbench that can affect every answer; code for recording is not included, as recordings have digests."""
RECORDING = (*_BOTH, "core/acquisition", "links", "devices")
"""Parts of tactbench that can affect every recording, in addition to those of the sensor and the rig."""


@cache
def source_digest(package: str, below: str = "") -> str:
    """Return the digest of all files of an importable package, or of the module or sub-package `below` in it.

    Every file counts with its path and bytes, tables and compiled modules included, except for byte code, hidden files
    and the commands and checks of tactbench, which affect no result. Nothing is imported. A package without a folder or
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
    return sha.hexdigest()


def sources_of(modules: Iterable[str], own: Sequence[str]) -> dict[str, str]:
    """Return source digests by name: of the parts `own` of tactbench, and of the packages of `modules`.

    Parameters
    ----------
    modules
        ``package.module`` or ``package.module:attribute``. In tactbench a sub-package of two levels counts, such as
        ``rigs/twin``; elsewhere the whole package.
    own
        Paths in tactbench, such as ``core/spec``.
    """
    places = {(PACKAGE, place) for place in own}
    for module in modules:
        package, *below = module.partition(":")[0].split(".")
        places.add((package, "/".join(below[:2]) if package == PACKAGE else ""))
    found = {}
    for package, place in sorted(places):
        module = "" if (Path(__file__).parents[2] / place).is_dir() else ".py"
        name = ".".join(filter(None, [package, *place.split("/")]))
        found[name] = source_digest(package, place and f"{place}{module}")
    return found


@cache
def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the versions of Python, numpy, scipy, scikit-learn and the distributions `more`, by name."""
    found = {"python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    return found | {name: version_of(name) for name in (*RELEVANT, *more)}


def version_of(distribution: str) -> str:
    """Return the version of an installed distribution, or "missing"."""
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "missing"


def digest_of(text: str) -> str:
    """Return the SHA-256 digest of a text, for a key or an identifier, as hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()


def identity_of(value: Any) -> dict[str, Any]:
    """Return the digest of an object's attributes, with versions and source digests of the code of its classes.

    Parameters
    ----------
    value
        Estimators, functions, arrays or plain data. Code is identified by version for classes of an installed
        distribution, by the file for classes of a script, and by all files of the package otherwise.

    Raises
    ------
    ValueError
        If the source cannot be determined, as for lambdas, and for objects defined in a notebook or a function.
    """
    import joblib

    found: dict[str, str] = {}
    distributions: set[str] = set()
    try:
        codes = pickletools.genops(pickle.dumps(value, 2, fix_imports=False))  # this one has modules as text
        modules = {str(argument).split()[0] for code, argument, _ in codes if code.name == "GLOBAL"}
        for top in {name.partition(".")[0] for name in modules} - sys.stdlib_module_names:
            file = Path(sys.modules[top].__file__ or "")
            if top == "__main__":
                found[top] = hashlib.sha256(file.read_bytes()).hexdigest()
            elif {"site-packages", "dist-packages"}.intersection(file.parts):
                distributions.update(_distributions()[top])
            else:
                found |= sources_of([top], ())
    except Exception as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error
    return {"object": joblib.hash(value), "versions": versions(tuple(sorted(distributions))), "source": found}


_distributions = cache(importlib.metadata.packages_distributions)
"""Names of the installed distributions that provide each importable package, by package."""


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
