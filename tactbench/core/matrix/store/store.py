"""Reading and writing of the cells and recordings of a result folder."""

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
"""Result row of a cell, with the keys of `tactbench.core.spec.row.RowModel`."""

_FULL = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the quota is used up",
    errno.EFBIG: "a file would be larger than this process may write",
}


class Store(Index):
    """Result folder at the path `folder`; a missing folder is created by :meth:`hold`."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._made_by: tuple[str, Mapping[str, Any]] = ("", {})
        self.superseded: list[str] = []
        """Names of cells whose latest result was replaced in this run by a result from other recordings."""

    @contextmanager
    def hold(self) -> Iterator[Store]:
        """Create the folder if necessary, and lock it for this process until the end of the context.

        Raises
        ------
        FolderError
            If the folder is in use by another run, or cannot be created or written.
        """
        with writing(self.folder):
            for part in ("recordings", "cells"):
                (self.folder / part).mkdir(parents=True, exist_ok=True)
            lock = os.open(self.folder / ".lock", os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if try_lock(lock) is False:
                raise FolderError(
                    f"Another run is using the result folder {self.folder}.",
                    hint="Wait until that run ends, or give another folder with --out DIR.",
                )
            with writing(self.folder):
                for left in (self.folder / "cells").glob(".*.partial"):  # of a run that was killed
                    left.unlink()
            yield self
        finally:
            os.close(lock)

    def begin(self, provenance: Mapping[str, Any]) -> str:
        """Set the provenance of all cells written from now on, and return its id."""
        self._made_by = digest_of(json.dumps(provenance, sort_keys=True)), provenance
        return self._made_by[0]

    def keep(
        self, row: Mapping[str, Any], sections: Mapping[str, Any], answers: Mapping[str, Answers] | None = None
    ) -> Row:
        """Write the file of an evaluated, failed or skipped cell, and return its row.

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
        """Make the finished cell of `row` the latest cell of its name, by writing its file again if necessary."""
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
        """Return the path of a cell's file, named by the key, or by the digest of the cell's name if it has no key."""
        return self.folder / "cells" / f"{row.get('key') or digest_of(row['cell'])}.h5"

    def cell(self, row: Mapping[str, Any]) -> CellFile:
        """Return the content of the cell's file for a row; raises FormatError if the file cannot be read."""
        return read_cell(self.file_of(row))

    def answers(self, key: str) -> dict[str, Answers]:
        """Return the answers of the finished cell with a key, by role; empty if its file is missing or unreadable."""
        path = self.folder / "cells" / f"{key}.h5"
        try:
            return dict(read_cell(path).answers) if path.is_file() else {}
        except FormatError as error:
            if str(error) not in self.troubles:
                self.troubles.append(str(error))
            return {}

    def recordings(self, row: Mapping[str, Any]) -> list[tuple[str, Path | None]]:
        """Return (name, path) of each recording listed in a row; the path is None if the file does not exist."""
        found = [(path, self.folder / named_file(path)) for path in row["recordings"]]
        return [(path, file if file.is_file() else None) for path, file in found]

    def beside(self, path: Path) -> str:
        """Return `path` relative to the result folder if inside, so that the folder can be moved, else absolute."""
        inside = path.is_relative_to(self.folder)
        return str(path.relative_to(self.folder)) if inside else str(path.resolve())


def _check_written(path: Path, cell: CellFile) -> None:
    """Read a written cell file back; if its content differs from `cell`, remove it and raise FolderError."""
    try:
        found = read_cell(path)
        same = (found.text, found.digests) == (cell.text, cell.digests)
    except FormatError:
        same = False
    if not same:
        path.unlink(missing_ok=True)
        raise FolderError(f"The content of {path} differs from what was written.", hint="Check the disk for errors.")


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Return a context that turns system errors in writing `folder` into a FolderError with a hint."""
    try:
        yield
    except OSError as error:
        kept = "Finished cells are kept"
        what = f"cannot be written: {_FULL.get(error.errno or 0) or error.strerror or error}"
        hint = f"{kept}: check the folder's permissions, or give another folder with --out DIR."
        if error.errno in _FULL:
            hint = f"{kept}: make room on the disk, then give the same command again."
        raise FolderError(f"The folder {folder} {what}.", hint=hint) from error
