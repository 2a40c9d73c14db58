"""Whether another process sees the files that this one sees."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

_END = 1 << 16
"""Bytes at each end of a file that its fingerprint covers."""


def paths_in(item: object) -> Iterator[Path]:
    """Yield every path that stands in `item`, a nest of tuples."""
    if isinstance(item, Path):
        yield item
    elif isinstance(item, tuple):
        for part in item:
            yield from paths_in(part)


def fingerprints(item: object) -> dict[str, str]:
    """Return the fingerprint of every file that `item` names and that can be read here, by its absolute path."""
    found = {}
    for path in paths_in(item):
        try:
            found[str(path.absolute())] = fingerprint(path)
        except OSError:
            continue  # the cell itself will say what is wrong with it
    return found


def fingerprint(path: Path) -> str:
    """Return a digest of a file's size and of its two ends: enough to tell recordings apart, and quick.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    status = path.stat()
    return _fingerprint(str(path.absolute()), status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=4096)
def _fingerprint(path: str, size: int, mtime_ns: int) -> str:
    digest = hashlib.sha256(str(size).encode())
    with Path(path).open("rb") as file:
        digest.update(file.read(_END))
        file.seek(max(size - _END, 0))
        digest.update(file.read(_END))
    return digest.hexdigest()[:16]


def unseen(expected: Mapping[str, str]) -> list[str]:
    """Return what this process sees otherwise than `expected`, one clause for each file."""
    clauses = []
    for name, there in expected.items():
        try:
            here = fingerprint(Path(name))
        except OSError as error:
            clauses.append(f"it cannot read {name} ({error.strerror or error})")
            continue
        if here != there:
            clauses.append(f"its {name} is another file")
    return clauses
