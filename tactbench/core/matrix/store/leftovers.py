"""What a killed run leaves behind: swept when the next one begins, unless a living process still writes it."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from tactbench.core.files import try_lock

_ASIDE = re.compile(r"\..+\.(\d{1,10})\.(partial|merging)")
"""Names of what is written aside by `tactbench.core.files.replace_file` and `tactbench.core.matrix.merge`: hidden, with
the writer's process."""


def sweep(folder: Path) -> None:
    """Remove half-written files of processes that are no more.

    Only names that tactbench gives, in folders that it makes; no link is followed. A recording that broke off is left
    for ``tactbench inspect --salvage``, unless the same one was recorded whole since.
    """
    for place in (folder, folder / "cells", folder / "provenance", folder / "cache"):
        for path in place.glob(".*.partial"):
            if is_left(path):
                _remove(path)
    for path in (folder / "recordings").glob("*/*"):
        if path.suffix != ".h5" and not path.parent.is_symlink() and _is_over(path):
            _remove(path)


def is_left(path: Path) -> bool:
    """Return whether a path is that of something written aside by a process of this machine that is no more."""
    named = _ASIDE.fullmatch(path.name)
    return named is not None and not _alive(int(named[1]))


def _is_over(path: Path) -> bool:
    """Return whether a file of a recording's writer is needed no more."""
    from tactbench.core.recording.format import COMPLETING, PARTIAL

    if path.name.endswith(COMPLETING):
        return not _being_written(path.with_name(path.name.removesuffix(COMPLETING) + PARTIAL))
    whole = path.name.endswith(PARTIAL) and path.with_name(path.name.removesuffix(PARTIAL)).is_file()
    return whole and not _being_written(path)


def _remove(path: Path) -> None:
    with suppress(OSError):
        if path.is_file() and not path.is_symlink():
            path.unlink()


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]  # proc_pid_stat(5)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError, IndexError):  # somebody else's, no number of a process, or a system without /proc
        return True
    return state not in "ZX"  # ended, and only not reaped yet


def _being_written(journal: Path) -> bool:
    """Return whether a process holds the lock that the writer of a recording keeps on its journal."""
    try:
        with journal.open("rb") as file:
            return try_lock(file.fileno()) is False
    except OSError:
        return False
