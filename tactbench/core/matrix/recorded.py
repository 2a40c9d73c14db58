"""What recordings say, each file read once: its content digest, and what it is a recording of."""

from __future__ import annotations

import importlib
import os
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.matrix.remembered import Facts, FileMemory


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
        return [path for path in paths if path not in self._digests and fact not in self._memory.facts(stat_of(path))]

    def learn(self, path: Path, facts: Facts, before: os.stat_result | None) -> None:
        """Take in what was read of a recording, perhaps in another process, which looked like `before` until then."""
        if facts.get("digest"):
            self._digests[path] = str(facts["digest"])
        self._memory.learn(before, stat_of(path), facts)

    def digest(self, path: Path) -> str:
        """Return the content digest of a recording; raises RecordingError if it cannot be read."""
        if path not in self._digests:
            before = stat_of(path)
            facts = self._memory.facts(before)
            self.learn(path, facts if facts.get("digest") else read_digest(path), before)
        return self._digests[path]

    def sensor_and_scene(self, path: Path) -> tuple[str, str | None]:
        """Return sensor and scene of a recording; raises RecordingError if it cannot be read.

        There is no scene where nobody planned it, for example that of an imported table.
        """
        facts = self._memory.facts(stat_of(path))
        if facts.get("sensor") is None:
            before = stat_of(path)
            facts = read_sensor_and_scene(path)
            self.learn(path, facts, before)
        return str(facts["sensor"]), facts["scene"]

    def made(self, path: Path, digest: str) -> None:
        """Note the digest of a recording that was made now, as its writer computed it."""
        self._digests[path] = digest
        self._made[path] = stat_of(path)

    @property
    def number_made(self) -> int:
        """How many recordings were made now."""
        return len(self._made)

    def save(self) -> None:
        """Write what was learned; a folder that cannot be written only costs time."""
        for path, before in self._made.items():
            self._memory.learn(before, stat_of(path), {"digest": self._digests[path]})
        self._memory.save()


def read_digest(path: Path) -> Facts:
    """Read the content digest of a recording; raises RecordingError if it cannot be read."""
    from tactbench.core.recording.reader import content_digest

    return {"digest": content_digest(path)}


def read_sensor_and_scene(path: Path) -> Facts:
    """Read what a recording is of; raises RecordingError if it cannot be read."""
    from tactbench.core.recording.reader import read_meta

    meta = read_meta(path)
    return {"sensor": meta.sensor.name, "scene": meta.scene.name if meta.scene else None}


def stat_of(path: Path) -> os.stat_result | None:
    """Return what a file looks like; None where there is none."""
    try:
        return path.stat()
    except OSError:
        return None


def read_all(
    read: Callable[[Path], Facts], paths: Sequence[Path], recorded: Recorded, choice: EngineChoice
) -> dict[Path, BaseException]:
    """Have `recorded` learn what `read` finds in every path; return what stopped it where it did.

    One child process reads one file after the other; a file that ends it, or takes longer than a cell may, costs its
    own result only.
    """
    if not paths:
        return {}
    importlib.import_module("h5py")  # once here, not once in every process that reads
    before = {path: stat_of(path) for path in paths}
    failed: dict[Path, BaseException] = {}
    for path, facts in choice.pool(1).each(read, paths):
        if isinstance(facts, BaseException):
            failed[path] = facts
        else:
            recorded.learn(path, facts, before[path])
    return failed
