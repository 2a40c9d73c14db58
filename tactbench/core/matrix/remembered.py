"""What was read out of a file, remembered by the file's size, times and inode, as git's index does.

A memory is only ever a short cut: it may be lost, and what it cannot vouch for is read again.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from tactbench.core.matrix.files import replace_file

Facts = Mapping[str, str | None]

_FORMAT = f"tactbench-memory 1, Python {sys.version_info.major}.{sys.version_info.minor}"
"""Another Python may read another syntax tree out of the same file."""

_MOST = 200_000
"""Files remembered; the ones not asked for longest are forgotten first."""
_LARGEST = 256 * 2**20
"""Bytes of a memory that is still read: 200,000 files take about 30 MiB."""

_TICK_NS = 50_000_000
"""A time stamp of a disk moves on every 10 ms at the latest (Linux, HZ = 100); five times that."""
_COARSE_TICK_NS = 2_000_000_000
"""FAT counts in steps of two seconds, some network disks in whole ones."""


class FileMemory:
    """Facts about files.

    Parameters
    ----------
    path
        The JSON file that holds them.
    clock
        Nanoseconds since the epoch, as disks count them.

    Notes
    -----
    The trap of such memories: a file changed twice within one tick of the disk's clock looks the same after both. So
    facts are only written down about files that had been at rest for longer than a tick when they were read; younger
    ones, and those from the future after a clock stepped back, are read again the next time.

    Several processes may use one file at once: each writes it whole, and adds to what the others have written.
    """

    def __init__(self, path: Path, clock: Callable[[], int] = time.time_ns) -> None:
        self._path = path
        self._clock = clock
        self._known = _entries(path)
        self._used: dict[str, list[object]] = {}
        self._fresh = False

    def facts(self, stat: os.stat_result) -> Facts:
        """Return what is known about the file that looks like `stat`; nothing if it looks otherwise now."""
        place = _place(stat)
        entry = self._used.get(place) or self._known.get(place)
        if entry is None or entry[:3] != [stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns]:
            return {}
        self._used[place] = entry
        return entry[3]  # type: ignore[return-value]

    def learn(self, before: os.stat_result, after: os.stat_result, facts: Facts) -> None:
        """Remember `facts`, read between `before` and `after`, if the file did not change and was at rest."""
        same = _place(before), before.st_size, before.st_mtime_ns, before.st_ctime_ns
        if same != (_place(after), after.st_size, after.st_mtime_ns, after.st_ctime_ns) or not self._at_rest(before):
            return
        entry = [*same[1:], {**self.facts(before), **facts}]
        self._used[_place(before)] = entry
        self._fresh = True

    def save(self) -> None:
        """Write down what was learned; a folder that cannot be written only costs time."""
        if not self._fresh:
            return
        rest = [(place, entry) for place, entry in _entries(self._path).items() if place not in self._used]
        kept = dict([*rest, *self._used.items()][-_MOST:])
        content = json.dumps({"format": _FORMAT, "files": kept}, separators=(",", ":")).encode()
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self._path, content, sync=False)  # what a power cut takes costs time
        except OSError:
            return
        self._fresh = False

    def _at_rest(self, stat: os.stat_result) -> bool:
        coarse = stat.st_mtime_ns % 1_000_000_000 == 0
        tick = _COARSE_TICK_NS if coarse else _TICK_NS
        return self._clock() - max(stat.st_mtime_ns, stat.st_ctime_ns) > tick


def _place(stat: os.stat_result) -> str:
    """Return which file it is, without its path: a result folder that is handed on tells nothing about a machine."""
    return f"{stat.st_dev:x}:{stat.st_ino:x}"


def _entries(path: Path) -> dict[str, list[object]]:
    try:
        if path.stat().st_size > _LARGEST:
            return {}
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(content, dict) or content.get("format") != _FORMAT or not isinstance(content.get("files"), dict):
        return {}
    return {place: entry for place, entry in content["files"].items() if _sound(entry)}


def _sound(entry: object) -> bool:
    return (
        isinstance(entry, list)
        and len(entry) == 4
        and isinstance(entry[3], dict)
        and all(value is None or isinstance(value, str) for value in entry[3].values())
    )
