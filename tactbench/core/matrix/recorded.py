"""What recordings say, each file read once: its content digest, and what it is a recording of.

What was read is remembered by the file's size, times and inode, as git's index does. The memory is only ever a short
cut: it may be lost, and what it cannot vouch for is read again.
"""

from __future__ import annotations

import importlib
import json
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.files import read_regular, replace_file
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool

Facts = Mapping[str, str | None]


class StatSignature(NamedTuple):
    """What tells a file from a changed one: which it is, not by its path (a folder handed on names none), and when."""

    inode: str
    """Device and inode."""
    size: int
    modified_ns: int
    changed_ns: int


_FORMAT = "tactbench-memory 2"

_TICK_NS = 50_000_000
"""A time stamp of a disk moves on every 10 ms at the latest (Linux, HZ = 100); five times that."""
_COARSE_TICK_NS = 2_000_000_000
"""FAT counts in steps of two seconds, some network disks in whole ones."""


class Recorded:
    """Facts about recordings.

    Parameters
    ----------
    memory
        A JSON file that remembers what was read, so that a run in which nothing is new opens none; it may be lost.
    clock
        Nanoseconds since the epoch, as disks count them.

    Notes
    -----
    The trap of such memories: a file changed twice within one tick of the disk's clock looks the same after both. So
    facts are only written down about files that had been at rest for longer than a tick when they were read; younger
    ones, and those from the future after a clock stepped back, are read again the next time.
    """

    def __init__(self, memory: Path, clock: Callable[[], int] = time.time_ns) -> None:
        self.digests: dict[Path, str] = {}
        """Of the content, known in this run."""
        self.made: dict[Path, StatSignature | None] = {}
        """Of recordings that were made in this run, as they were then."""
        self._path = memory
        self._clock = clock
        self._files: dict[str, list[Any]] = {}
        self._fresh = False
        try:
            content = json.loads(read_regular(memory, 2**28))
            if content["format"] == _FORMAT:
                self._files = {name: entry for name, entry in content["files"].items() if _is_entry(entry)}
        except (OSError, ValueError, RecursionError, KeyError, TypeError, AttributeError):
            pass

    def facts(self, signature: StatSignature | None) -> Facts:
        """Return what is known about the file with this signature; nothing if it has another one now, or is none."""
        if signature is None:
            return {}
        entry = self._files.get(signature.inode)
        return entry[3] if entry is not None and entry[:3] == list(signature[1:]) else {}

    def learn(self, before: StatSignature | None, after: StatSignature | None, facts: Facts) -> None:
        """Remember `facts`, read between `before` and `after`, if the file did not change and was at rest."""
        if before is None or before != after:
            return
        tick = _COARSE_TICK_NS if before.modified_ns % 1_000_000_000 == 0 else _TICK_NS
        if self._clock() - max(before.modified_ns, before.changed_ns) <= tick:
            return
        self._files[before.inode] = [*before[1:], {**self.facts(before), **facts}]
        self._fresh = True

    def digest(self, path: Path) -> str:
        """Return the content digest of a recording; raises RecordingError if it cannot be read."""
        if path not in self.digests:
            before = stat_signature(path)
            facts = self.facts(before)
            if not facts.get("digest"):
                facts = read_digest(path)
                self.learn(before, stat_signature(path), facts)
            self.digests[path] = str(facts["digest"])
        return self.digests[path]

    def sensor_and_scene(self, path: Path) -> tuple[str, str | None]:
        """Return sensor and scene of a recording; raises RecordingError if it cannot be read.

        There is no scene where nobody planned it, for example that of an imported table.
        """
        before = stat_signature(path)
        facts = self.facts(before)
        if facts.get("sensor") is None:
            facts = read_sensor_and_scene(path)
            self.learn(before, stat_signature(path), facts)
        return str(facts["sensor"]), facts["scene"]

    def save(self) -> None:
        """Write what was learned; a folder that cannot be written only costs time."""
        for path, before in self.made.items():
            self.learn(before, stat_signature(path), {"digest": self.digests[path]})
        if not self._fresh:
            return
        content = json.dumps({"format": _FORMAT, "files": self._files}, separators=(",", ":")).encode()
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self._path, content, sync=False)  # what a power cut takes costs time
        except OSError:
            return
        self._fresh = False


def read_digest(path: Path) -> Facts:
    """Read the content digest of a recording; raises RecordingError if it cannot be read."""
    from tactbench.core.recording.reader import content_digest

    return {"digest": content_digest(path)}


def read_sensor_and_scene(path: Path) -> Facts:
    """Read what a recording is of; raises RecordingError if it cannot be read."""
    from tactbench.core.recording.reader import read_meta

    meta = read_meta(path)
    return {"sensor": meta.sensor.name, "scene": meta.scene.name if meta.scene else None}


def stat_signature(path: Path) -> StatSignature | None:
    """Return the signature of a file; None where there is none."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return StatSignature(f"{stat.st_dev:x}:{stat.st_ino:x}", stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns)


def read_all(
    read: Callable[[Path], Facts], fact: str, paths: Iterable[Path], recorded: Recorded, limits: Limits
) -> dict[Path, BaseException]:
    """Have `recorded` learn what `read` finds in every path of which it does not know the `fact`, such as its digest.

    One child process reads one file after the other; a file that ends it, or takes longer than a cell may, costs its
    own result only.

    Returns
    -------
    failed
        What stopped it, by path.
    """
    paths = [
        path for path in paths if path not in recorded.digests and fact not in recorded.facts(stat_signature(path))
    ]
    if not paths:
        return {}
    importlib.import_module("h5py")  # once here, not once in every process that reads
    before = {path: stat_signature(path) for path in paths}
    failed: dict[Path, BaseException] = {}
    for path, facts in Pool(1, limits, reuse=True).each(read, paths):
        if isinstance(facts, BaseException):
            failed[path] = facts
            continue
        recorded.learn(before[path], stat_signature(path), facts)
        if facts.get("digest"):
            recorded.digests[path] = str(facts["digest"])
    return failed


def _is_entry(entry: object) -> bool:
    return (
        isinstance(entry, list)
        and len(entry) == 4
        and isinstance(entry[3], dict)
        and all(value is None or isinstance(value, str) for value in entry[3].values())
    )
