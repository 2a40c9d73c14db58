"""The result folder: one file for each evaluated cell, and an index of these files.

::

    OUT/
      cells/KEY.h5                       one cell: its row, sections of its key, provenance and answers
      results.sqlite                     an index of cells/ and recordings/, rebuilt if lost or outdated
      recordings/SENSOR/SCENE-KEY.h5     recordings made by a rig
      leaderboard.md, .csv, .json        leaderboard of the last run

The files are authoritative: a lost, damaged or outdated index, which serves quick listings and queries, is rebuilt from
the files. An entry is valid while size and modification time of its file are unchanged. On a read-only disk, the index
is kept in memory.
"""

from __future__ import annotations

import errno
import hashlib
import io
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from tactbench.core.errors import FolderError, FormatError
from tactbench.core.files import hdf5_image, named_file, replace_file, try_lock, utf8_json
from tactbench.core.provenance import digest_of
from tactbench.core.samples import Answers
from tactbench.core.spec.row import FORMAT

_BEGINNING = b"tactbench-cell 5 "
_USER_BLOCK = 512
_COLUMNS = tuple(column.name for column in fields(Answers))


@dataclass(frozen=True)
class CellFile:
    """Content of a cell's file: row, sections of the key, provenance and answers."""

    row: dict[str, Any]
    """Result row with the keys of `tactbench.core.spec.row.RowModel`."""
    sections: Mapping[str, Any] = field(default_factory=dict)
    """Sections of the cell's key; see `tactbench.core.matrix.keys`."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    ended_ns: int = 0
    """Time of writing [ns since the epoch]; the latest file of a cell is valid."""
    answers: Mapping[str, Answers] = field(default_factory=dict)
    """Answers by role; empty for a cell that did not finish."""

    @property
    def text(self) -> str:
        """Everything except for the answers, as JSON."""
        head = {"row": self.row, "sections": self.sections, "provenance": self.provenance, "ended_ns": self.ended_ns}
        return json.dumps(head, allow_nan=False)

    @property
    def digests(self) -> dict[str, str]:
        """SHA-256 digests of the answers by role."""
        return {role: hashlib.sha256(_table(one).tobytes()).hexdigest() for role, one in self.answers.items()}

    def content(self) -> bytes:
        """Return the content of the HDF5 file as bytes."""
        import numpy as np

        text = self.text.encode()

        def fill(file: Any) -> None:
            file["head"] = np.bytes_(text)
            for role, answers in self.answers.items():
                file.create_dataset(f"answers/{role}", data=_table(answers), shuffle=True, compression=4)

        body = hdf5_image(fill)
        return _opening(body).ljust(_USER_BLOCK, b"\0") + body


def read_cell(path: Path, *, answers: bool = True) -> CellFile:
    """Return the content of a cell's file, with or without its answers.

    Raises
    ------
    FormatError
        If the file is not a cell's file of this version, or was changed after writing.
    """
    import h5py

    try:
        content = path.read_bytes()
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error}.", hint="Run the cell again.") from error
    begins = content[:_USER_BLOCK].rstrip(b"\0")
    if begins != _opening(content[_USER_BLOCK:]):
        what = "was changed after writing" if begins.startswith(_BEGINNING) else "is not a cell's file of this version"
        raise FormatError(f"{path} {what}.", hint="Run the cell again.")
    with h5py.File(io.BytesIO(content), "r") as file:
        head = json.loads(file["head"][()])
        row = head["row"]
        if number := row.pop("repeat", None):  # until replicates were named by their seeds
            name = f"{row['cell'].removesuffix(str(number))}{row['seed']}"
            row |= {"cell": name, "key": row["key"] or path.stem}
        tables = {role: table[()] for role, table in file.get("answers", {}).items()} if answers else {}
    columns = {role: {name: table[name].copy() for name in _COLUMNS} for role, table in tables.items()}
    return CellFile(**head, answers={role: Answers(**values) for role, values in columns.items()})


def _opening(body: bytes) -> bytes:
    """Return the user block with a digest, to detect damaged files, on which the HDF5 library may crash."""
    return _BEGINNING + hashlib.sha256(body).hexdigest().encode()


def _table(answers: Answers) -> Any:
    """Return the (n,) structured array of answers with one field for each column, little-endian."""
    import numpy as np

    columns = {name: getattr(answers, name) for name in _COLUMNS}
    types = [(name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in columns.items()]
    table = np.empty(len(answers), dtype=types)
    for name, values in columns.items():
        table[name] = values
    return table


Row = dict[str, Any]
"""Result row of a cell, with the keys of `tactbench.core.spec.row.RowModel`."""

_FULL = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the quota is used up",
    errno.EFBIG: "a file would be larger than this process may write",
}


VERSION = 4
_LOCKED_S = 10.0
"""Time limit for waiting for another process that writes the index [s]."""
_TYPES = {str: "TEXT", int: "INTEGER", bool: "INTEGER", float: "REAL"}
COLUMNS = {
    name: next(_TYPES[kind] for kind in (str, float, int, bool) if kind in kinds)
    for name, kinds in FORMAT.items()
    if not kinds & {dict, list}
}
"""Columns of the index with their SQL types: the keys of a row whose values are neither mappings nor lists."""
_SCHEMA = f"""
CREATE TABLE IF NOT EXISTS cells (
  file TEXT PRIMARY KEY, size INTEGER, modified_ns INTEGER, ended_ns INTEGER,
  {", ".join(f'"{name}" {kind}' for name, kind in COLUMNS.items())}, row TEXT);
CREATE INDEX IF NOT EXISTS names ON cells (cell, ended_ns);
CREATE INDEX IF NOT EXISTS keys ON cells (key);
CREATE VIEW IF NOT EXISTS latest AS SELECT * FROM cells AS one WHERE NOT EXISTS (
  SELECT 1 FROM cells AS other WHERE other.cell = one.cell AND other.ended_ns > one.ended_ns);
CREATE TABLE IF NOT EXISTS recordings (
  path TEXT PRIMARY KEY, size INTEGER, modified_ns INTEGER, digest TEXT, sensor TEXT, scene TEXT);
PRAGMA user_version = {VERSION};
"""


class Store:
    """Result folder at the path `folder`; a missing folder is created by :meth:`hold`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.troubles: list[str] = []
        """One sentence for each file that could not be read."""
        self._database: sqlite3.Connection | None = None
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

    def rows(self) -> list[dict[str, Any]]:
        """Return the latest row of every cell, sorted by name and seed."""
        found = self._all("SELECT row FROM latest ORDER BY rtrim(cell, '0123456789'), seed")
        return [json.loads(text) for (text,) in found]

    def finished(self, key: str) -> dict[str, Any] | None:
        """Return the row of the finished cell with a key, or None."""
        found = self._all("SELECT row FROM cells WHERE key = ? AND status = 'done'", key)
        return json.loads(found[0][0]) if found else None

    def provenance(self, name: str) -> Mapping[str, Any]:
        """Return the provenance (software and machine) with the id in ``row["made_by"]``; empty if unknown."""
        found = self._all("SELECT file FROM cells WHERE made_by = ?", name)
        return read_cell(self.folder / "cells" / found[0][0], answers=False).provenance if found else {}

    def about(self, recording: Path) -> Mapping[str, Any]:
        """Return the content digest, sensor and scene of a recording; raises RecordingError if it cannot be read.

        The scene is None for recordings without a planned scene, such as an imported table.
        """
        file = (utf8_json(str(recording.resolve())), *signature(recording))
        found = self._all(
            "SELECT digest, sensor, scene FROM recordings WHERE path = ? AND size = ? AND modified_ns = ?", *file
        )
        facts = found[0] if found else _read_recording(recording)
        if not found:
            self._all("REPLACE INTO recordings VALUES (?, ?, ?, ?, ?, ?)", *file, *facts)
        return dict(zip(("digest", "sensor", "scene"), facts, strict=True))

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

    def _files_of(self, cell: str) -> list[tuple[str, str, str]]:
        """Return (file, key, status) of each file of a cell, the latest first."""
        return self._all("SELECT file, key, status FROM cells WHERE cell = ? ORDER BY ended_ns DESC", cell)

    def _put(self, path: Path, cell: CellFile) -> None:
        """Add or replace the index entry of a cell's file."""
        row = cell.row
        facts = (path.name, *signature(path), cell.ended_ns, *map(row.get, COLUMNS), json.dumps(row))
        self._all(f"REPLACE INTO cells VALUES ({', '.join('?' * len(facts))})", *facts)

    def _drop(self, name: str) -> None:
        """Remove the index entry of a file."""
        self._all("DELETE FROM cells WHERE file = ?", name)

    def _refresh(self) -> None:
        """Update the index from the files in the folder."""
        self.troubles = []
        found = {path.name: path for path in (self.folder / "cells").glob("[!.]*.h5")}
        known = dict(self._all("SELECT file, size || ' ' || modified_ns FROM cells"))
        for name in sorted({*known, *found}):
            if name in found and known.get(name) == "{} {}".format(*signature(found[name])):
                continue
            self._drop(name)
            try:
                if name in found:
                    self._put(found[name], read_cell(found[name], answers=False))
            except FormatError as error:
                self.troubles.append(str(error))

    def _all(self, query: str, *values: Any) -> list[Any]:
        """Return the rows of an SQL statement; if the disk is full or the index damaged, use an index in memory."""
        path = self.folder / "results.sqlite"
        try:
            if self._database is None:
                self._database = _opened(path if self.folder.is_dir() else None)
                self._refresh()
            with self._database:
                return self._database.execute(query, values).fetchall()
        except sqlite3.Error as error:
            if not isinstance(error, sqlite3.OperationalError):  # damaged, or of another version: made anew next time
                with suppress(OSError):
                    path.unlink()
            self._database = _opened(None)
            self._refresh()
            return self._all(query, *values)


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


def signature(path: Path) -> tuple[int, int]:
    """Return size [bytes] and modification time [ns] of a file; zeros if the file does not exist."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_size, stat.st_mtime_ns


def _opened(path: Path | None) -> sqlite3.Connection:
    """Open the database at `path` (None: in memory); raises sqlite3.Error if damaged or of another version."""
    database = sqlite3.connect(path or ":memory:", timeout=_LOCKED_S)
    (version,) = database.execute("PRAGMA user_version").fetchone()
    if version not in (0, VERSION):
        database.close()
        raise sqlite3.DatabaseError(version)
    # A crash or a power cut costs nothing: the files are read again.
    database.executescript("PRAGMA synchronous = OFF; PRAGMA journal_mode = MEMORY;" + _SCHEMA)
    return database


def _read_recording(path: Path) -> tuple[str, str, str | None]:
    from tactbench.core.recording.reader import open_recording

    with open_recording(path) as recording:
        meta = recording.meta
        return recording.verify(), meta.sensor.name, meta.scene.name if meta.scene else None
