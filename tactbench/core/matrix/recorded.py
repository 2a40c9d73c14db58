"""What recordings say, each file read once: its content digest, and what it is a recording of."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.matrix.remembered import Facts, FileMemory


class Subject(NamedTuple):
    """What a recording is a recording of."""

    sensor: str
    scene: str | None
    """None: nobody planned its scene, for example that of an imported table."""


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

    def unread(self, paths: Iterable[Path], fact: str) -> list[Path]:
        """Return those of `paths` that would have to be opened for the `fact`: ``digest`` or ``sensor``."""
        return [path for path in paths if path not in self._digests and fact not in self._facts(path)]

    def learn(self, path: Path, read: Read) -> None:
        """Take in what was read of a recording, perhaps in another process."""
        before, facts, after = read
        if "digest" in facts:
            self._digests[path] = facts["digest"]
        if before is not None and after is not None:
            self._memory.learn(before, after, facts)

    def digest(self, path: Path) -> str:
        """Return the content digest of a recording; raises RecordingError if it cannot be read."""
        if path not in self._digests:
            known = self._facts(path).get("digest")
            if known is None:
                self.learn(path, read_digest(path))
            else:
                self._digests[path] = known
        return self._digests[path]

    def subject(self, path: Path) -> Subject:
        """Return what a recording is of; raises RecordingError if it cannot be read."""
        facts = self._facts(path)
        sensor = facts.get("sensor")
        if sensor is None:
            read = read_subject(path)
            self.learn(path, read)
            facts = read[1]
        return Subject(str(sensor or facts["sensor"]), facts["scene"])

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


Read = tuple["os.stat_result | None", "dict[str, Any]", "os.stat_result | None"]
"""Facts, and what the file looked like before and after they were read."""


def read_digest(path: Path) -> Read:
    """Read the content digest of a recording; raises RecordingError if it cannot be read."""
    from tactbench.core.recording.reader import content_digest

    return _stat(path), {"digest": content_digest(path)}, _stat(path)


def read_subject(path: Path) -> Read:
    """Read what a recording is of; raises RecordingError if it cannot be read."""
    from tactbench.core.recording.reader import read_meta

    before, meta, after = _stat(path), read_meta(path), _stat(path)
    return before, {"sensor": meta.sensor.name, "scene": meta.scene.name if meta.scene else None}, after


def _stat(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except OSError:
        return None
