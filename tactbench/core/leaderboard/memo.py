"""What statistics came to, kept by a digest of everything that decided it: in this process, and in a result folder.

The file is a convenience: it may be damaged, foreign or gone, and is then made anew. Who recalls something from it
checks that it can be what was asked for.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import marshal
from functools import cache
from pathlib import Path
from typing import Any

from tactbench.core.matrix.files import replace_file

FILE = Path("cache") / "ranks.json"
"""Inside a result folder."""
LARGEST_BYTES = 64_000_000
"""A larger file is not read."""
MOST = 4096
"""Answers that a file remembers, the latest."""

STATISTICS = ("tactbench.core.statistics", "tactbench.core.evaluation")
"""Packages whose code decides what statistics come to."""

_known: dict[str, Any] = {}
_added: set[str] = set()


def digest_of(*facts: Any) -> str:
    """Return a digest of `facts`, which are plain as JSON is, or bytes; raises ValueError if they are not."""
    # Version 2 of the format writes equal values as equal bytes; it is written here and never read.
    return hashlib.sha256(marshal.dumps(facts, 2)).hexdigest()


def ordered(value: Any) -> Any:
    """Return a mapping as its pairs in order: what was just computed and what was read again have one digest."""
    if isinstance(value, dict):
        # Few are mappings: only these are asked again.
        return [(key, ordered(inner) if isinstance(inner, dict) else inner) for key, inner in sorted(value.items())]
    return value


@cache
def source_digest(package: str) -> bytes:
    """Return a digest of the files of a package, read as bytes; of nothing if there is no such package."""
    found = importlib.util.find_spec(package)
    places = found.submodule_search_locations or () if found else ()
    total = hashlib.sha256()
    for folder in map(Path, places):
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.suffix != ".pyc":
                total.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return total.digest()


def recall(digest: str) -> Any:
    """Return what is remembered, fit for JSON and possibly from a file that anybody may have written; or None."""
    return _known.get(digest)


def remember(digest: str, answer: Any) -> None:
    """Keep an answer, which is fit for JSON."""
    _known[digest] = answer
    _added.add(digest)


def load(folder: Path) -> None:
    """Recall what a result folder remembers."""
    path = folder / FILE
    try:
        if path.stat().st_size > LARGEST_BYTES:
            return
        entries = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return
    if isinstance(entries, dict):
        for digest, answer in entries.items():
            _known.setdefault(digest, answer)


def save(folder: Path) -> None:
    """Write what has been added since; a folder that cannot be written costs the next reader the time, no more."""
    if not _added:
        return
    try:
        replace_file(folder / FILE, json.dumps(dict(list(_known.items())[-MOST:])).encode())
    except OSError:
        return
    _added.clear()
