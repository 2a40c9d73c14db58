"""Digests of source code that comments, docstrings and formatting do not change.

A plugin's whole package counts, not its one module: a changed module or table beside it changes what it computes. So do
the packages it imports: their version if they were installed, their source if they lie in somebody's working folder.
"""

from __future__ import annotations

import hashlib
import sys
import time
import uuid
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tactbench.core.matrix.distributions import Distributions, is_installed
from tactbench.core.matrix.meaning import imports_of, meaning_of
from tactbench.core.matrix.packages import SourceFile, files_of, is_known, location_of, package_of
from tactbench.core.matrix.remembered import FileMemory

Purpose = Literal["recording", "answer"]

OURS = "tactbench"
_DOORS = frozenset({"tactbench", "tactbench.plugin", "tactbench.testing"})

SHOWING = (
    "core/calibration/", "core/choosing/", "core/cli/", "core/conformance/", "core/cost/", "core/leaderboard/",
    "core/report/", "core/statistics/", "core/tables/",
    "core/matrix/checkout.py", "core/matrix/files.py", "core/matrix/machine.py",
    "core/matrix/progress.py", "core/matrix/provenance.py", "core/matrix/store", "__main__.py", "testing.py",
    "benchmarks.yaml", "matrices/", "calibration.yaml", "calibration/",
)  # fmt: skip
"""Rooms of tactbench that show, keep or compare what was computed: a new colour in a table computes nothing again.
Of the core: the floors above the matrix, and the matrix's own keeping. In doubt, a room counts."""

_NOT_FOR: dict[Purpose, tuple[str, ...]] = {
    # Answers are made from recordings, whose bytes are in the key: how those came about is their own affair.
    "answer": ("sensors/", "rigs/", "links/", "devices/", "core/acquisition"),
    # Whoever records knows nothing of what is asked afterwards; the contracts of the imports hold it to that.
    "recording": ("tasks/", "estimators/", "core/evaluation/", "core/matrix/"),
}


@dataclass(frozen=True)
class Source:
    """What the code behind something is."""

    packages: Mapping[str, Mapping[str, str]]
    """Digest of each file, by package."""
    versions: Mapping[str, str]
    """Versions of the distributions that those packages import."""


class SourceDigests:
    """Digests of packages, each looked at once in the life of this object.

    Parameters
    ----------
    memory
        Remembers the digest of each file, since parsing takes time; or the JSON file of such a memory. It may be lost.
    clock
        As for `FileMemory`.
    """

    def __init__(self, memory: Path | FileMemory, clock: Callable[[], int] = time.time_ns) -> None:
        self._memory = memory if isinstance(memory, FileMemory) else FileMemory(memory, clock)
        self._distributions = Distributions(self._memory)
        self._packages: dict[tuple[str, tuple[str, ...]], tuple[dict[str, str], frozenset[str]]] = {}
        self._behind: dict[tuple[Purpose, frozenset[str]], Source] = {}

    def package(self, module: str) -> str:
        """Return one digest of the top-level package that holds `module`."""
        return digest_of(self._look_at(package_of(module))[0])

    def behind(self, modules: Iterable[str], purpose: Purpose) -> Source:
        """Return the code behind `modules` (``package.module`` or ``package.module:attribute``), tactbench's included.

        A package that nobody can find has a digest that never comes twice: what it makes is not used again.
        """
        asked = frozenset(modules)
        if (purpose, asked) not in self._behind:
            self._behind[purpose, asked] = self._follow(asked, purpose)
        return self._behind[purpose, asked]

    def save(self) -> None:
        """Write what was learned; a folder that cannot be written only costs time."""
        self._memory.save()

    def _follow(self, modules: frozenset[str], purpose: Purpose) -> Source:
        packages: dict[str, Mapping[str, str]] = {}
        versions: dict[str, str] = {}
        ours = {module.partition(":")[0] for module in modules if package_of(module) == OURS}
        waiting = sorted({package_of(module) for module in modules} - {OURS})
        while waiting:
            name = waiting.pop()
            if name in packages:
                continue
            packages[name], imported = self._look_at(name)
            ours |= {module for module in imported if package_of(module) == OURS}
            for other in sorted(imported):
                if package_of(other) == OURS or other in packages or other in versions:
                    continue
                place = location_of(other)
                if place is None:
                    versions[other] = "not a file" if is_known(other) else "absent"
                    continue
                version = self._distributions.version_of(other, place) if is_installed(place) else None
                if version is None:
                    waiting.append(other)
                else:
                    versions[other] = version
        packages[OURS] = self._ours(purpose, ours - _DOORS)
        return Source(packages, versions)

    def _ours(self, purpose: Purpose, used: set[str]) -> Mapping[str, str]:
        """Return tactbench's own files that count; every one if somebody uses rooms that otherwise would not."""
        left_out = (*SHOWING, *_NOT_FOR[purpose])
        rooms = [module.partition(".")[2].replace(".", "/") + "/" for module in used]
        beyond = any(room.startswith(left_out) or room == "core/" for room in rooms)
        return self._look_at(OURS, () if beyond else left_out)[0]

    def _look_at(self, package: str, left_out: tuple[str, ...] = ()) -> tuple[dict[str, str], frozenset[str]]:
        if (package, left_out) not in self._packages:
            digests: dict[str, str] = {}
            imported: set[str] = set()
            for file in files_of(package):
                if left_out and file.name.startswith(left_out):
                    continue
                digest, imports = self._read(file, follow=package != OURS)
                digests[_free(file.name, digests)] = digest
                imported.update(imports)
            if not digests:
                digests["(its source cannot be found)"] = uuid.uuid4().hex
            self._packages[package, left_out] = digests, frozenset(imported) - {package} - sys.stdlib_module_names
        return self._packages[package, left_out]

    def _read(self, file: SourceFile, *, follow: bool) -> tuple[str, Iterable[str]]:
        facts = self._memory.facts(file.stat)
        digest, imports = facts.get("digest"), facts.get("imports")
        if digest is not None and (imports is not None or not follow):
            return digest, (imports or "").split()
        path = Path(file.path)
        try:
            content = path.read_bytes()
            after = path.stat()
        except OSError:
            return f"unreadable {uuid.uuid4().hex}", ()
        is_python = file.name.endswith((".py", ".pyw"))
        digest = hashlib.sha256(meaning_of(content) if is_python else content).hexdigest()[:32]
        found = imports_of(content) if is_python and follow else ()
        self._memory.learn(file.stat, after, {"digest": digest, **({"imports": " ".join(found)} if follow else {})})
        return digest, found


def digest_of(facts: Mapping[str, str]) -> str:
    """Return one digest of a mapping, whatever its order."""
    text = "".join(f"{name}\0{facts[name]}\0" for name in sorted(facts))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _free(name: str, taken: Mapping[str, str]) -> str:
    """Return `name`, numbered where another portion of the package has a file of that name."""
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name} ({number})"
    return free
