"""What was read out of a file, remembered by the file's size, times and inode, as git's index does.

A memory is only ever a short cut: it may be lost, and what it cannot vouch for is read again.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tactbench.core.files import read_regular, replace_file

Facts = Mapping[str, str | None]

_FORMAT = "tactbench-memory 2"

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
    """

    def __init__(self, path: Path, clock: Callable[[], int] = time.time_ns) -> None:
        self._path = path
        self._clock = clock
        self._files = _entries(path)
        self._fresh = False

    def facts(self, stat: os.stat_result | None) -> Facts:
        """Return what is known about the file that looks like `stat`; nothing if it looks otherwise now, or is none."""
        if stat is None:
            return {}
        name, *looks = _looks(stat)
        entry = self._files.get(name)
        return entry[3] if entry is not None and entry[:3] == looks else {}

    def learn(self, before: os.stat_result | None, after: os.stat_result | None, facts: Facts) -> None:
        """Remember `facts`, read between `before` and `after`, if the file did not change and was at rest."""
        if before is None or after is None or _looks(before) != _looks(after) or not self._at_rest(before):
            return
        name, *looks = _looks(before)
        self._files[name] = [*looks, {**self.facts(before), **facts}]
        self._fresh = True

    def save(self) -> None:
        """Write down what was learned; a folder that cannot be written only costs time."""
        if not self._fresh:
            return
        content = json.dumps({"format": _FORMAT, "files": self._files}, separators=(",", ":")).encode()
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


def _looks(stat: os.stat_result) -> tuple[str, int, int, int]:
    """Return which file it is, not by its path (a folder that is handed on names none), and its size and times."""
    return f"{stat.st_dev:x}:{stat.st_ino:x}", stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns


def _entries(path: Path) -> dict[str, list[Any]]:
    try:
        content = json.loads(read_regular(path, 2**28))
        if content["format"] == _FORMAT:
            return {name: entry for name, entry in content["files"].items() if _is_entry(entry)}
    except (OSError, ValueError, RecursionError, KeyError, TypeError, AttributeError):
        pass
    return {}


def _is_entry(entry: object) -> bool:
    return (
        isinstance(entry, list)
        and len(entry) == 4
        and isinstance(entry[3], dict)
        and all(value is None or isinstance(value, str) for value in entry[3].values())
    )
