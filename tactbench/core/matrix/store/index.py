"""``results.sqlite``: an index of the files of a result folder, for quick listings and for queries.

The files are authoritative. A lost, damaged or outdated index is rebuilt from them; an entry is valid as long as size
and modification time of its file are unchanged. Where it cannot be
written, on a read-only disk, the index lives in memory.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from tactbench.core.errors import FormatError
from tactbench.core.files import utf8_json
from tactbench.core.matrix.store.cell_file import CellFile, read_cell
from tactbench.core.spec.row import FORMAT

VERSION = 3
_LOCKED_S = 10.0
"""Seconds to wait for another process that writes the index."""
_TYPES = {str: "TEXT", int: "INTEGER", bool: "INTEGER", float: "REAL"}
COLUMNS = {
    name: next(_TYPES[kind] for kind in (str, float, int, bool) if kind in kinds)
    for name, kinds in FORMAT.items()
    if not kinds & {dict, list}
}
"""Columns of the index: the keys of a row that are neither mappings nor lists."""
_SCHEMA = f"""
CREATE TABLE IF NOT EXISTS cells (
  file TEXT PRIMARY KEY, size INTEGER, modified_ns INTEGER, ended_ns INTEGER,
  {", ".join(f'"{name}" {kind}' for name, kind in COLUMNS.items())}, row TEXT);
CREATE INDEX IF NOT EXISTS names ON cells (cell, ended_ns);
CREATE INDEX IF NOT EXISTS keys ON cells (key);
CREATE VIEW IF NOT EXISTS latest AS SELECT * FROM cells AS one WHERE NOT EXISTS (
  SELECT 1 FROM cells AS other WHERE other.cell = one.cell AND other.ended_ns > one.ended_ns);
CREATE TABLE IF NOT EXISTS provenance (id TEXT PRIMARY KEY, text TEXT);
CREATE TABLE IF NOT EXISTS recordings (
  path TEXT PRIMARY KEY, size INTEGER, modified_ns INTEGER, digest TEXT, sensor TEXT, scene TEXT);
PRAGMA user_version = {VERSION};
"""


class Index:
    """The index of the result folder `folder`, opened at once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.troubles: list[str] = []
        """Sentences about files that could not be read."""
        self._database = _opened(folder / "results.sqlite")
        self.refresh()

    def refresh(self) -> None:
        """Bring the index up to date with the files."""
        found = {path.name: path for path in (self.folder / "cells").glob("[!.]*.h5")}
        known = dict(self._all("SELECT file, size || ' ' || modified_ns FROM cells"))
        changed = {name: path for name, path in found.items() if known.get(name) != "{} {}".format(*signature(path))}
        lost = known.keys() - found.keys()
        for name in lost:
            self.drop(name)
        for name, path in sorted(changed.items()):
            try:
                self.put(path, read_cell(path, answers=False))
            except FormatError as error:
                self.drop(name)
                self.troubles.append(str(error))

    def put(self, path: Path, cell: CellFile) -> None:
        """Add or replace the entry of the file of a cell."""
        row = cell.row
        values = [row.get(name) for name in COLUMNS]
        facts = (path.name, *signature(path), cell.ended_ns, *values, json.dumps(row))
        self._all(f"REPLACE INTO cells VALUES ({', '.join('?' * len(facts))})", *facts)
        self._all("INSERT OR IGNORE INTO provenance VALUES (?, ?)", row.get("made_by", ""), json.dumps(cell.provenance))

    def drop(self, name: str) -> None:
        """Remove the entry of a file."""
        self._all("DELETE FROM cells WHERE file = ?", name)

    def files_of(self, cell: str) -> list[tuple[str, str, str]]:
        """Return file, key and status of the files of a cell, the latest first."""
        return self._all("SELECT file, key, status FROM cells WHERE cell = ? ORDER BY ended_ns DESC", cell)

    def finished(self, key: str) -> dict[str, Any] | None:
        """Return the row of a finished cell, or None."""
        found = self._all("SELECT row FROM cells WHERE key = ? AND status = 'done'", key)
        return json.loads(found[0][0]) if found else None

    def latest(self) -> Iterator[dict[str, Any]]:
        """Yield the latest row of every cell, in the order of their names and replicates."""
        for (text,) in self._all("SELECT row FROM latest ORDER BY rtrim(cell, '0123456789'), seed"):
            yield json.loads(text)

    def provenance(self, name: str) -> dict[str, Any]:
        """Return the provenance that rows call `name`; empty if there is none."""
        found = self._all("SELECT text FROM provenance WHERE id = ?", name)
        return json.loads(found[0][0]) if found else {}

    def recording(self, path: Path, read: Callable[[Path], Mapping[str, Any]]) -> Mapping[str, Any]:
        """Return digest, sensor and scene of a recording; `read` reads them if the file is not known as it is now."""
        place = utf8_json(str(path.resolve()))
        size, modified_ns = signature(path)
        found = self._all(
            "SELECT digest, sensor, scene FROM recordings WHERE path = ? AND size = ? AND modified_ns = ?",
            place, size, modified_ns,
        )  # fmt: skip
        if found:
            return dict(zip(("digest", "sensor", "scene"), found[0], strict=True))
        facts = read(path)
        values = (place, size, modified_ns, facts["digest"], facts["sensor"], facts["scene"])
        self._all("REPLACE INTO recordings VALUES (?, ?, ?, ?, ?, ?)", *values)
        return facts

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def _all(self, query: str, *values: Any) -> list[Any]:
        """Return what a statement finds; if the disk is full or the index damaged, go on with one in memory."""
        try:
            with self._database:
                return self._database.execute(query, values).fetchall()
        except sqlite3.Error as error:
            self.close()
            if not isinstance(error, sqlite3.OperationalError):  # damaged: the next command makes it anew
                with suppress(OSError):
                    (self.folder / "results.sqlite").unlink()
            self._database = _in_memory()
            self.refresh()
            return self._database.execute(query, values).fetchall()


def signature(path: Path) -> tuple[int, int]:
    """Return size and time of modification [ns] of a file; zeros if there is none."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_size, stat.st_mtime_ns


def _opened(path: Path) -> sqlite3.Connection:
    """Open the index; one that is damaged or of another version is removed, for the next command to make it anew."""
    if path.parent.is_dir():
        try:
            database = sqlite3.connect(path, timeout=_LOCKED_S)
            (version,) = database.execute("PRAGMA user_version").fetchone()
            if version in (0, VERSION):
                # What a crash or a power cut takes is read from the files again.
                database.executescript("PRAGMA synchronous = OFF; PRAGMA journal_mode = MEMORY;" + _SCHEMA)
                return database
            database.close()
            path.unlink()
        except sqlite3.OperationalError:  # it cannot be written
            pass
        except (sqlite3.Error, OSError):
            with suppress(OSError):
                path.unlink()
    return _in_memory()


def _in_memory() -> sqlite3.Connection:
    database = sqlite3.connect(":memory:")
    database.executescript(_SCHEMA)
    return database
