"""Which cell was under way in the run's own process: had it ended the run, the next run must know."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from tactbench.core.matrix.files import replace_file


class InFlight:
    """One small file in a result folder, there while a cell is carried out in this process.

    Parameters
    ----------
    folder
        The result folder.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / "cache" / "running"
        self._set = False

    def ended_a_run(self, key: str) -> bool:
        """Return whether a run ended while it carried out the cell with this key."""
        try:
            return self._path.read_text(encoding="utf-8") == key
        except (OSError, ValueError):
            return False

    def set(self, key: str) -> None:
        """Say that the cell with this key begins: to whoever comes after this process, not after a power cut."""
        replace_file(self._path, key.encode(), sync=False)
        self._set = True

    def clear(self) -> None:
        """Say that it has got its row."""
        if self._set or self._path.exists():
            with suppress(OSError):
                self._path.unlink(missing_ok=True)
        self._set = False
