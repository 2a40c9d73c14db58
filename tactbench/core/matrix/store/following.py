"""Which recordings that a row names may be opened: the row may be a stranger's, and a path in it may lead anywhere."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tactbench.core.errors import RecordingError


class Following:
    """Follows paths of rows.

    Followed are files inside the result folder; files in the folders that the person has named; and elsewhere regular
    files that hold the very content the row tells of, so that one's own runs on recordings elsewhere need no naming,
    while a stranger shows nothing to anybody that he does not know himself.

    Parameters
    ----------
    folder
        The result folder.
    allowed
        Folders that the person has named.
    """

    def __init__(self, folder: Path, allowed: Iterable[Path]) -> None:
        self._folder = folder
        self._allowed = [path.resolve() for path in allowed]
        self._same: dict[tuple[Path, str], bool] = {}

    def __call__(self, path: str, digest: str) -> Path | None:
        """Return the file, or None if it may not be followed; `digest` is what its content should have."""
        if "\0" in path:
            return None
        found = (self._folder / path).resolve()
        if any(found.is_relative_to(root) for root in (self._folder.resolve(), *self._allowed)):
            return found
        asked = (found, digest)
        if asked not in self._same:
            self._same[asked] = bool(digest) and found.is_file() and _content(found) == digest
        return found if self._same[asked] else None


def _content(path: Path) -> str:
    from tactbench.core.recording.reader import content_digest

    try:
        return content_digest(path)
    except RecordingError:
        return ""
