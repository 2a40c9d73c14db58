"""Reading and writing of a result folder."""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import FolderError, FormatError
from tactbench.core.files import named_file, replace_file, try_lock, utf8_json
from tactbench.core.matrix.store.cell_file import CellFile, read_cell
from tactbench.core.matrix.store.index import Index
from tactbench.core.provenance.source import digest_of

if TYPE_CHECKING:
    from tactbench.core.samples import Answers

Row = dict[str, Any]
"""One cell, as `tactbench.core.spec.row.RowModel` describes it."""

_FULL = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the quota is used up",
    errno.EFBIG: "a file would be larger than this process may write",
}


class Store(Index):
    """A result folder at the path `folder`, which need not exist: :meth:`hold` makes it."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._made_by: tuple[str, Mapping[str, Any]] = ("", {})
        self.superseded: list[str] = []
        """Cells whose latest answer was replaced, by this object, with one from other recordings."""

    @contextmanager
    def hold(self) -> Iterator[Store]:
        """Create the folder if necessary, and lock it for this run until the end of the context.

        Raises
        ------
        FolderError
            If another run holds the folder, or it cannot be created or written.
        """
        with writing(self.folder):
            for part in ("recordings", "cells"):
                (self.folder / part).mkdir(parents=True, exist_ok=True)
            lock = os.open(self.folder / ".lock", os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if try_lock(lock) is False:
                raise FolderError(
                    f"Another run is at work in {self.folder}.",
                    hint="Wait until it ends, or give another folder with --out DIR.",
                )
            with writing(self.folder):
                for left in (self.folder / "cells").glob(".*.partial"):  # of a run that was killed
                    left.unlink()
            yield self
        finally:
            os.close(lock)

    def begin(self, provenance: Mapping[str, Any]) -> str:
        """Set the provenance of cells that are written from now on, and return its id."""
        self._made_by = digest_of(json.dumps(provenance, sort_keys=True))[:16], provenance
        return self._made_by[0]

    def keep(
        self, row: Mapping[str, Any], sections: Mapping[str, Any], answers: Mapping[str, Answers] | None = None
    ) -> Row:
        """Write the file of a cell that has ended, and return its row.

        Raises
        ------
        FolderError
            If the folder cannot be written; finished cells are kept.
        ValueError, TypeError
            If the row is not plain data; nothing is written.
        """
        # Texts of a row are UTF-8 from here on, whatever was given: a name of a file may hold any byte.
        text = json.dumps({**row, "made_by": self._made_by[0]}, allow_nan=False, ensure_ascii=False)
        kept: Row = json.loads(utf8_json(text))
        self._write(CellFile(kept, sections, self._made_by[1], answers=answers or {}))
        return kept

    def reuse(self, row: Row) -> None:
        """Make a finished cell the latest one of its name in `row`."""
        latest = self._files_of(row["cell"])
        if not latest or latest[0][1] != row["key"]:
            cell = read_cell(self.file_of(row))
            self._write(replace(cell, row={**cell.row, "cell": row["cell"]}))

    def _write(self, cell: CellFile) -> None:
        cell, path = replace(cell, ended_ns=time.time_ns()), self.file_of(cell.row)
        content = cell.content()
        with writing(self.folder):
            replace_file(path, content)
            _check_written(path, cell)
            before = self._files_of(cell.row["cell"])
            old = self.finished(before[0][1]) if before else None
            if old is not None and cell.row.get("digests") not in ([], None, old.get("digests")):
                self.superseded.append(cell.row["cell"])
            for name, _key, status in before:
                if status != "done" and name != path.name:  # superseded; finished ones stay for other versions
                    (path.parent / name).unlink(missing_ok=True)
                    self._drop(name)
        self._put(path, cell)

    def file_of(self, row: Mapping[str, Any]) -> Path:
        """Return the file of a cell: named by its key, or by its name if it stopped before it had one."""
        return self.folder / "cells" / f"{row.get('key') or digest_of(row['cell'])}.h5"

    def cell(self, row: Mapping[str, Any]) -> CellFile:
        """Return the content of the file of a row's cell; raises FormatError if it cannot be read."""
        return read_cell(self.file_of(row))

    def answers(self, key: str) -> dict[str, Answers]:
        """Return the answers of a finished cell by role; none for a cell that is missing or cannot be read."""
        path = self.folder / "cells" / f"{key}.h5"
        try:
            return dict(read_cell(path).answers) if path.is_file() else {}
        except FormatError as error:
            if str(error) not in self.troubles:
                self.troubles.append(str(error))
            return {}

    def recordings(self, row: Mapping[str, Any]) -> list[tuple[str, Path | None]]:
        """Return each recording that a row names, in its order, and its file, or None if it is not there."""
        found = [(path, self.folder / named_file(path)) for path in row["recordings"]]
        return [(path, file if file.is_file() else None) for path, file in found]

    def beside(self, path: Path) -> str:
        """Return `path` relative to the folder where it lies inside, so that the folder may be moved."""
        inside = path.is_relative_to(self.folder)
        return str(path.relative_to(self.folder)) if inside else str(path.resolve())


def _check_written(path: Path, cell: CellFile) -> None:
    """Read the file of a cell back; FolderError, and no file, if it holds anything else."""
    try:
        found = read_cell(path)
        same = (found.text, found.digests) == (cell.text, cell.digests)
    except FormatError:
        same = False
    if not same:
        path.unlink(missing_ok=True)
        raise FolderError(f"What is read back of {path} is not what was written.", hint="Did the disk fail?")


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Turn system errors while `folder` is written into a FolderError with a hint."""
    try:
        yield
    except OSError as error:
        kept = "What was finished before is kept"
        what = f"cannot be written: {_FULL.get(error.errno or 0) or error.strerror or error}"
        hint = f"{kept}: check its permissions, or give another one with --out DIR."
        if error.errno in _FULL:
            hint = f"{kept}: make room, and the same command goes on from there."
        raise FolderError(f"The folder {folder} {what}.", hint=hint) from error
