"""What ranking came to, kept by a digest of everything that decided it: in this process, and in a result folder.

The file is a convenience: it may be damaged, foreign or gone, and is then made anew. Nothing is taken from it but whole
numbers in their ranges.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import marshal
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from tactbench.core.matrix.files import replace_file

Places = Mapping[str, tuple[int, int, int, bool]]
"""By cell: place, lowest and highest place, whether it is shared."""

FILE = Path("cache") / "ranks.json"
"""Inside a result folder."""
LARGEST_BYTES = 64_000_000
"""A larger file is not read."""
MOST_BLOCKS = 4096
"""Blocks that a file remembers, the latest."""

_known: dict[str, Places] = {}
_added: set[str] = set()


def digest_of(*facts: Any) -> str:
    """Return a digest of `facts`, which are plain as JSON is, or bytes; raises ValueError if they are not."""
    # Version 2 of the format writes equal values as equal bytes; it is written here and never read.
    return hashlib.sha256(marshal.dumps(facts, 2)).hexdigest()


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


def recall(digest: str) -> Places | None:
    """Return what ranking came to, or None."""
    return _known.get(digest)


def remember(digest: str, places: Places) -> None:
    """Keep what ranking came to."""
    _known[digest] = dict(places)
    _added.add(digest)


def load(folder: Path) -> None:
    """Recall what a result folder remembers; entries that cannot be ranks are passed over."""
    path = folder / FILE
    try:
        if path.stat().st_size > LARGEST_BYTES:
            return
        entries = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return
    if isinstance(entries, dict):
        for digest, entry in entries.items():
            places = dict(_checked(entry))
            if places:
                _known.setdefault(digest, places)


def save(folder: Path) -> None:
    """Write what has been added since; a folder that cannot be written costs the next reader the time, no more."""
    if not _added:
        return
    latest = list(_known.items())[-MOST_BLOCKS:]
    text = json.dumps({digest: [[cell, *place] for cell, place in places.items()] for digest, places in latest})
    try:
        replace_file(folder / FILE, text.encode())
    except OSError:
        return
    _added.clear()


def _checked(entry: Any) -> Iterator[tuple[str, tuple[int, int, int, bool]]]:
    """Yield the places of an entry from disk; nothing at all if one of them cannot be."""
    if not isinstance(entry, list):
        return
    read = [one for one in entry if isinstance(one, list) and len(one) == 5 and isinstance(one[0], str)
            and all(type(number) is int for number in one[1:4]) and type(one[4]) is bool]  # fmt: skip
    if len(read) == len(entry):
        for cell, place, low, high, tied in read:
            yield cell, (place, low, high, tied)
