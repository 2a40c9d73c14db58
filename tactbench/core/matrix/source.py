"""A digest of source code that comments and formatting do not change.

A plugin's whole package counts, not its one module: a changed module beside it changes what it computes.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
from collections.abc import Iterable
from pathlib import Path

from tactbench.core.matrix.files import replace_file

# Rooms of tactbench that show results but do not make them: a new colour in a table recomputes nothing.
_DISPLAY = ("core/cli", "core/cost", "core/leaderboard", "core/conformance", "testing.py", "__main__.py")


class SourceDigests:
    """Digests of packages, remembered by the bytes of each file.

    Parameters
    ----------
    memory
        A JSON file of raw digest -> digest of the syntax tree, since parsing takes time; it may be lost.
    """

    def __init__(self, memory: Path) -> None:
        self._memory = memory
        self._known = _remembered(memory)
        self._fresh = False
        self._packages: dict[str, str] = {}

    def package(self, module: str) -> str:
        """Return the digest of the top-level package that holds `module`."""
        name = module.partition(":")[0].partition(".")[0]
        if name not in self._packages:
            self._packages[name] = self._digest(_files(name))
        return self._packages[name]

    def save(self) -> None:
        """Write what was learned; a folder that cannot be written only costs time."""
        if self._fresh:
            try:
                self._memory.parent.mkdir(parents=True, exist_ok=True)
                replace_file(self._memory, json.dumps(self._known).encode())
            except OSError:
                return

    def _digest(self, files: Iterable[tuple[str, Path]]) -> str:
        whole = hashlib.sha256()
        for name, path in files:
            content = path.read_bytes()
            raw = hashlib.sha256(content).hexdigest()
            if raw not in self._known:
                self._known[raw] = hashlib.sha256(_meaning(content)).hexdigest()
                self._fresh = True
            whole.update(f"{name}\0{self._known[raw]}\0".encode())
        return whole.hexdigest()


def _meaning(content: bytes) -> bytes:
    try:
        return ast.dump(ast.parse(content)).encode()
    except (SyntaxError, ValueError):
        return content


def _files(package: str) -> list[tuple[str, Path]]:
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        return []
    if not spec.submodule_search_locations:
        return [(package, Path(spec.origin))]
    found = []
    for root in map(Path, spec.submodule_search_locations):
        for path in root.rglob("*.py"):
            name = path.relative_to(root).as_posix()
            if not (package == "tactbench" and name.startswith(_DISPLAY)):
                found.append((name, path))
    return sorted(found)


def _remembered(memory: Path) -> dict[str, str]:
    try:
        known = json.loads(memory.read_text())
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) and all(isinstance(value, str) for value in known.values()) else {}
