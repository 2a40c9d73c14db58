"""Where results lie: one shard a cell, and an index that lists a thousand of them quickly.

::

    OUT/
      recordings/SENSOR/SCENE-KEY.h5     what the rig recorded
      cells/KEY.h5                       one finished cell: row, predictions
      index.jsonl                        the rows of all shards, one a line
      scores.json                        what a seed decides in the last run: compare it byte by byte
      leaderboard.md, .csv, .json        the last run's table
      run.json                           who ran it, with what
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.errors import UsageError
from tactbench.core.matrix.files import replace_file

Row = dict[str, Any]
SHARD_VERSION = 1


class Store:
    """A result folder.

    Parameters
    ----------
    folder
        Made if it does not exist.

    Raises
    ------
    UsageError
        If the folder cannot be made or written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            for part in ("recordings", "cells", "cache"):
                (folder / part).mkdir(parents=True, exist_ok=True)
            replace_file(folder / "cache" / "writable", b"")
        except OSError as error:
            raise UsageError(
                f"The folder {folder} cannot be written: {error.strerror or error}.",
                hint="Give another one with --out DIR.",
            ) from error
        self._rows: dict[str, Row] | None = None

    def recording_path(self, sensor: str, scene: str, key: str) -> Path:
        """Return where the recording with this key lies, or will lie."""
        return self.folder / "recordings" / sensor / f"{scene}-{key[:12]}.h5"

    def finished(self, key: str) -> Row | None:
        """Return the row of a finished cell, or None."""
        if self._rows is None:
            self._rows = _read_index(self.folder / "index.jsonl")
        shard = self.folder / "cells" / f"{key}.h5"
        if not shard.exists():
            return None
        if key not in self._rows:
            row = _read_shard(shard)
            if row is None:
                return None
            self._rows[key] = row
        return dict(self._rows[key])

    def keep(self, key: str, row: Row, arrays: Mapping[str, Any]) -> None:
        """Write a finished cell: aside, synced, renamed; then its line in the index."""
        import h5py

        shard = self.folder / "cells" / f"{key}.h5"
        aside = shard.with_suffix(".partial")
        try:
            with h5py.File(aside, "w") as file:
                file.attrs["format"] = "tactbench-cell"
                file.attrs["format_version"] = SHARD_VERSION
                file.attrs["row"] = json.dumps(row, sort_keys=True)
                for name, values in arrays.items():
                    file.create_dataset(name, data=np.asarray(values), compression="gzip", shuffle=True)
                file.flush()
            aside.replace(shard)
        except BaseException:
            aside.unlink(missing_ok=True)
            raise
        with (self.folder / "index.jsonl").open("a", encoding="utf-8") as index:
            index.write(json.dumps({"key": key, "row": row}, sort_keys=True) + "\n")
        if self._rows is not None:
            self._rows[key] = dict(row)

    def write(self, name: str, text: str) -> Path:
        """Write one of the result files whole."""
        path = self.folder / name
        replace_file(path, text.encode())
        return path


def _read_index(path: Path) -> dict[str, Row]:
    rows: dict[str, Row] = {}
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError:
        return rows
    for line in lines:
        try:
            entry = json.loads(line)
            rows[entry["key"]] = entry["row"]
        except (ValueError, KeyError, TypeError):
            continue  # a line cut short by a crash: the shard itself is asked instead
    return rows


def _read_shard(path: Path) -> Row | None:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            row = json.loads(str(file.attrs["row"]))
    except (OSError, KeyError, ValueError):
        return None
    return row if isinstance(row, dict) else None
