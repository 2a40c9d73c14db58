"""What recordings say, each file read once: its content digest, and what it is a recording of."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

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
    """

    def __init__(self, memory: Path) -> None:
        self._memory = FileMemory(memory)
        self._digests: dict[Path, str] = {}
        self._made: dict[Path, os.stat_result | None] = {}

    def digest(self, path: Path) -> str:
        """Return the content digest of a recording; raises RecordingError if it cannot be read."""
        if path not in self._digests:
            known = self._facts(path).get("digest")
            self._digests[path] = known if known is not None else self._read(path)
        return self._digests[path]

    def subject(self, path: Path) -> Subject:
        """Return what a recording is of; raises RecordingError if it cannot be read."""
        facts = self._facts(path)
        sensor = facts.get("sensor")
        if sensor is None:
            from tactbench.core.recording.reader import read_meta

            before, meta, after = _stat(path), read_meta(path), _stat(path)
            sensor, facts = meta.sensor.name, {"scene": meta.scene.name if meta.scene else None}
            if before is not None and after is not None:
                self._memory.learn(before, after, {"sensor": sensor, **facts})
        return Subject(sensor, facts["scene"])

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

    def _read(self, path: Path) -> str:
        from tactbench.core.recording.reader import content_digest

        before, digest, after = _stat(path), content_digest(path), _stat(path)
        if before is not None and after is not None:
            self._memory.learn(before, after, {"digest": digest})
        return digest


def _stat(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except OSError:
        return None
