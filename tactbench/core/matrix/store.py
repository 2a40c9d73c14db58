"""Where results lie: one shard a cell, and an index that lists a thousand of them quickly.

::

    OUT/
      recordings/SENSOR/SCENE-KEY.h5     what the rig recorded
      cells/KEY.h5                       one finished cell: row, and a group of answers for each role
      index.jsonl                        the rows of all shards, one a line
      unfinished.json                    the rows of the last run that did not end well, with their reasons
      scores.json                        what a seed decides in the last run: compare it byte by byte
      leaderboard.md, .csv, .json        the last run's table
      run.json                           who ran it, with what
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.matrix.files import replace_file
from tactbench.core.samples import Answers
from tactbench.core.spec.scene import Role

Row = dict[str, Any]
SHARD_VERSION = 2
_ANSWER_COLUMNS = tuple(column.name for column in fields(Answers))


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

    def recording(self, path: str, digest: str = "") -> Path | None:
        """Return the file of a recording that a row names; None if it may not be followed."""
        return self.folder / path

    def provenance(self, name: str) -> dict[str, Any]:
        """Return who computed a cell, with what, by the id in its row; empty if not known."""
        return {}

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

    def rows(self) -> list[Row]:
        """Return the rows of all finished cells, the latest of each name, then the unfinished ones of the last run."""
        latest: dict[str, Row] = {}
        for key, row in _read_index(self.folder / "index.jsonl").items():
            if (self.folder / "cells" / f"{key}.h5").exists():
                latest[row["cell"]] = row
        try:
            unfinished = json.loads((self.folder / "unfinished.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            unfinished = []
        return [*latest.values(), *(row for row in unfinished if row["cell"] not in latest)]

    def answers(self, key: str) -> dict[str, Answers]:
        """Return what a finished cell answered, by role; nothing for a cell that is not there or cannot be read."""
        import h5py

        try:
            with h5py.File(self.folder / "cells" / f"{key}.h5", "r") as file:
                return {
                    role: Answers(**{name: group[name][()] for name in _ANSWER_COLUMNS})
                    for role, group in file.items()
                    if isinstance(group, h5py.Group)
                }
        except (OSError, KeyError):
            return {}

    def keep(self, key: str, row: Row, sets: Mapping[Role, Answers]) -> None:
        """Write a finished cell: aside, synced, renamed; then its line in the index."""
        import h5py

        shard = self.folder / "cells" / f"{key}.h5"
        aside = shard.with_suffix(".partial")
        try:
            with h5py.File(aside, "w") as file:
                file.attrs["format"] = "tactbench-cell"
                file.attrs["format_version"] = SHARD_VERSION
                file.attrs["row"] = json.dumps(row, sort_keys=True)
                for role, answers in sets.items():
                    group = file.create_group(role)
                    for name in _ANSWER_COLUMNS:
                        values = getattr(answers, name)
                        group.create_dataset(name, data=values, compression="gzip", shuffle=True)
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
