"""What recordings say, each file read once: its content digest, and what it is a recording of."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

from tactbench.core.matrix.remembered import Facts, FileMemory

T = TypeVar("T")

Read = Callable[[Sequence[Path]], Mapping[Path, "T | BaseException"]]
"""Reads files, wherever that is safe, and returns what stopped it in place of what it could not read."""


class Subject(NamedTuple):
    """What a recording is a recording of."""

    sensor: str
    scene: str | None
    """None: nobody planned its scene, for example that of an imported table."""


def read_digest(path: Path) -> str:
    """Read the content digest of a recording; raises RecordingError."""
    from tactbench.core.recording.reader import content_digest

    return content_digest(path)


def read_subject(path: Path) -> Subject:
    """Read what a recording is of; raises RecordingError."""
    from tactbench.core.recording.reader import read_meta

    meta = read_meta(path)
    return Subject(meta.sensor.name, meta.scene.name if meta.scene else None)


class Recorded:
    """Recordings, by path.

    Parameters
    ----------
    memory
        A JSON file that remembers what was read, so that a run in which nothing is new opens none; it may be lost.
    clock
        As for `FileMemory`.
    """

    def __init__(self, memory: Path, clock: Callable[[], int] = time.time_ns) -> None:
        self._memory = FileMemory(memory, clock)
        self._digests: dict[Path, str] = {}
        self._made: dict[Path, os.stat_result | None] = {}

    def digest(self, path: Path) -> str:
        """Return the content digest of a recording, read here if need be; raises RecordingError."""
        return _or_raise(self.digests([path], lambda unknown: _each(read_digest, unknown))[path])

    def subject(self, path: Path) -> Subject:
        """Return what a recording is of, read here if need be; raises RecordingError."""
        return _or_raise(self.subjects([path], lambda unknown: _each(read_subject, unknown))[path])

    def digests(self, paths: Sequence[Path], read: Read[str]) -> dict[Path, str | BaseException]:
        """Return the content digest of every recording, or why it has none; `read` reads those not known."""
        known = {path: self._digests.get(path) or self._facts(path).get("digest") for path in paths}
        found = self._learn([path for path in paths if known[path] is None], read, lambda digest: {"digest": digest})
        whole = {path: digest if digest is not None else found[path] for path, digest in known.items()}
        self._digests.update((path, digest) for path, digest in whole.items() if isinstance(digest, str))
        return whole

    def subjects(self, paths: Sequence[Path], read: Read[Subject]) -> dict[Path, Subject | BaseException]:
        """Return what every recording is of, or why nobody can tell; `read` reads those not known."""
        known = {path: self._facts(path) for path in paths}
        found = self._learn([path for path in paths if "sensor" not in known[path]], read, Subject._asdict)
        return {
            path: found[path] if path in found else Subject(str(facts["sensor"]), facts["scene"])
            for path, facts in known.items()
        }

    def made(self, path: Path, digest: str) -> None:
        """Note the digest of a recording that was made now, as its writer computed it."""
        self._digests[path] = digest
        self._made[path] = _stat(path)

    @property
    def number_made(self) -> int:
        """How many recordings were made now."""
        return len(self._made)

    def save(self) -> None:
        """Write what was learned; a folder that cannot be written only costs time."""
        for path, before in self._made.items():
            now = _stat(path)
            if before is not None and now is not None:
                self._memory.learn(before, now, {"digest": self._digests[path]})
        self._memory.save()

    def _facts(self, path: Path) -> Facts:
        stat = _stat(path)
        return {} if stat is None else self._memory.facts(stat)  # where there is none, reading says what is wrong

    def _learn(
        self, paths: Sequence[Path], read: Read[T], facts: Callable[[T], Facts]
    ) -> Mapping[Path, T | BaseException]:
        before = {path: _stat(path) for path in paths}
        found = read(paths) if paths else {}
        for path, said in found.items():
            old, new = before[path], _stat(path)
            if old is not None and new is not None and not isinstance(said, BaseException):
                self._memory.learn(old, new, facts(said))
        return found


def _each(read: Callable[[Path], T], paths: Sequence[Path]) -> dict[Path, T | BaseException]:
    return {path: read(path) for path in paths}


def _or_raise(found: T | BaseException) -> T:
    if isinstance(found, BaseException):
        raise found
    return found


def _stat(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except OSError:
        return None
