"""``results.sqlite``: index of the files of a result folder, for quick listings and for queries.

The files are authoritative: a lost, damaged or outdated index is rebuilt from the files. An entry is valid while size
and modification time of its file are unchanged. On a read-only disk, the index is kept in memory.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tactbench.core.errors import FormatError
from tactbench.core.files import utf8_json
from tactbench.core.matrix.store.cell_file import CellFile, read_cell
from tactbench.core.spec.row import FORMAT

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


class Index:
    """Index of the result folder `folder`; its database is opened at first use."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.troubles: list[str] = []
        """One sentence for each file that could not be read."""
        self._database: sqlite3.Connection | None = None

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
