"""What a killed run leaves behind: swept when the next one begins, unless a living process still writes it."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

_ASIDE = re.compile(r"\..+\.(\d{1,10})\.partial")
"""Names of files written aside by `tactbench.core.matrix.files.replace_file`: hidden, with the writer's process."""


def sweep(folder: Path) -> int:
    """Remove half-written files of processes that are no more, and return how many.

    Only names that tactbench gives, in folders that it makes. A recording that broke off is left for
    ``tactbench inspect --salvage``, unless the same one was recorded whole since.
    """
    swept = 0
    for place in (folder, folder / "cells", folder / "provenance", folder / "cache"):
        for path in _files(place, ".partial"):
            named = _ASIDE.fullmatch(path.name)
            if named and not alive(named[1]):
                swept += _remove(path)
    for sensor in _folders(folder / "recordings"):
        swept += sum(_sweep_recording(path) for path in _files(sensor) if path.suffix != ".h5")
    return swept


def _sweep_recording(path: Path) -> int:
    from tactbench.core.recording.format import COMPLETING, PARTIAL

    if path.name.endswith(COMPLETING):
        journal = path.with_name(path.name.removesuffix(COMPLETING) + PARTIAL)
    elif path.name.endswith(PARTIAL) and path.with_name(path.name.removesuffix(PARTIAL)).is_file():
        journal = path
    else:
        return 0
    return 0 if _being_written(journal) else _remove(path)


def _files(place: Path, ending: str = "") -> list[Path]:
    try:
        with os.scandir(place) as found:
            return [Path(one.path) for one in found if one.name.endswith(ending) and one.is_file(follow_symlinks=False)]
    except OSError:
        return []


def _folders(place: Path) -> list[Path]:
    try:
        with os.scandir(place) as found:
            return [Path(one.path) for one in found if one.is_dir(follow_symlinks=False)]
    except OSError:
        return []


def _remove(path: Path) -> int:
    with suppress(OSError):
        path.unlink()
        return 1
    return 0


def alive(process: str) -> bool:
    """Return whether the process of this number lives; text that is no number is taken for one that does."""
    if not process.isdecimal() or int(process) > 2**31:
        return True
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass
    return True


def _being_written(journal: Path) -> bool:
    """Return whether a process holds the lock that the writer of a recording keeps on its journal."""
    try:
        import fcntl

        with journal.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (ImportError, OSError):
        return False
    return False
