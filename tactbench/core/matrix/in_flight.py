"""Which cell was under way in the run's own process: had it ended the run, the next run must know."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


class InFlight:
    """One small file in a result folder, there while cells are carried out in this process.

    Parameters
    ----------
    folder
        The result folder.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / "cache" / "running"
        self._file = -1

    def ended_a_run(self, key: str) -> bool:
        """Return whether a run ended while it carried out the cell with this key."""
        try:
            return self._path.read_text(encoding="utf-8") == key
        except (OSError, ValueError):
            return False

    def set(self, key: str) -> None:
        """Say that the cell with this key begins: to whoever comes after this process, not after a power cut.

        It stands there until the next one begins: a cell that has got its row is not asked for again.
        """
        if self._file < 0:
            self._file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        os.lseek(self._file, 0, os.SEEK_SET)
        os.write(self._file, key.encode())  # keys are equally long

    def clear(self) -> None:
        """Say that no cell is under way, and none has ended the process."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
