"""Examination of a stored cell: reasons why a run would not reuse it, and its recomputation bit for bit."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tactbench.core.errors import TactbenchError, UsageError, did_you_mean
from tactbench.core.files import named_file
from tactbench.core.matrix.keys import Keys, differences
from tactbench.core.matrix.merge import SEED_DECIDES
from tactbench.core.matrix.plan import Cell, cell_of
from tactbench.core.matrix.plan_recordings import RecordingSource, request_key, requests_for
from tactbench.core.matrix.run import EngineChoice, Run
from tactbench.core.matrix.store import Row, Store
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.plugins.registry import Registry, installed
from tactbench.core.progress import Progress

_SHOWN = 8
"""Largest number of cells listed in a message."""


@dataclass(frozen=True)
class StoredCell:
    """A cell of a result folder with its row and the paths of its recordings, existing or not."""

    store: Store
    registry: Registry
    cell: Cell
    row: Row
    paths: list[Path]

    @property
    def missing(self) -> list[Path]:
        """Paths of the recordings that do not exist."""
        return [path for path in self.paths if not path.exists()]

    def changes(self) -> list[str]:
        """Return sentences with the reasons why a run would not reuse the result: differences, then missing files."""
        missing = self.missing
        try:
            digests = {path: self.store.about(path)["digest"] for path in self.paths if path not in missing}
            before = self.store.cell(self.row).sections
            key, now = Keys(self.registry).of_cell(self.cell, digests)
        except TactbenchError as error:
            return [str(error)]
        if not missing:
            return [] if self.store.finished(key) or not before else differences(before, now)
        text = f"{len(missing)} of {len(self.paths)} recordings are missing, for example {missing[0].stem}"
        reason = f"{text}: they were never made, were removed, or have another key now"
        return [*(differences({**before, "data": {}}, {**now, "data": {}}) if before else []), reason]

    def again(self, progress: Progress) -> tuple[Row, list[str], int]:
        """Compute the cell again in this process, without changing the result folder.

        Return the new row, sentences on differences from the stored row, and the number of simulated recordings that
        were made again in a temporary folder.
        """
        with tempfile.TemporaryDirectory(prefix="tactbench-rerun-") as place, Store(Path(place)).hold() as again:
            keys, need = Keys(self.registry), request_key(self.cell)
            source = RecordingSource(self.paths)
            if self.registry.rigs[self.cell.rig].simulated:
                requests = requests_for([self.cell], self.registry, keys, again)[need]
                source = RecordingSource([request.path for request in requests], requests)
            elif self.missing:
                hint = "Run the matrix again with --rig replay --recordings DIR."
                raise UsageError(f"The recording {self.missing[0]} does not exist.", hint=hint)
            run = Run(again, self.registry, keys, {need: source}, EngineChoice("in-process"), None, progress)
            run.carry_out([self.cell], timed=True)
            row = run.rows[self.cell.name]
            done = row["status"] == self.row["status"] == "done"
            compared = SEED_DECIDES if done else ("status", "reason")
            old, new = ({name: one[name] for name in compared} for one in (self.row, row))
            for facts, kept in ((old, self.store.cell(self.row)), (new, again.cell(row))) if done else ():
                facts |= {"recording": kept.sections["data"], "answers": kept.digests}
        return row, differences(old, new), run.recorded


def stored_cell(store: Store, given: str) -> StoredCell:
    """Return the stored cell whose name contains `given`, see `meant`."""
    rows = {row["cell"]: row for row in store.rows()}
    row = rows[meant(given, list(rows))]
    registry, cell = with_declared_of(installed(), [row]), cell_of(row)
    paths = [store.folder / named_file(path) for path in row["recordings"]]
    if registry.rigs[cell.rig].simulated:
        requests = requests_for([cell], registry, Keys(registry), store)[request_key(cell)]
        paths = [request.path for request in requests]
    return StoredCell(store, registry, cell, row, paths)


def meant(given: str, names: Sequence[str]) -> str:
    """Return the name among `names` that matches `given`: the name, some of its parts in order, or a piece of it.

    ``biotac/curvature/forest`` is ``biotac/curvature/twin/karl2016/forest/1`` if no other cell has these parts.

    The replicates of a cell differ only in the last part of their names: if all matches are replicates of one cell,
    the first replicate is returned.

    Raises
    ------
    UsageError
        If `given` matches several cells, which the message lists, or no cell.
    """
    if given in names:
        return given
    parts = "/(.*/)?".join(map(re.escape, given.split("/")))
    patterns = f"(^|/){parts}(/|$)", re.escape(given)
    found = next(filter(None, ([one for one in names if re.search(pattern, one)] for pattern in patterns)), [])
    if len({_replicate(name)[0] for name in found}) == 1:
        return min(found, key=_replicate)
    if not found:
        raise UsageError(
            f"There is no cell called {given!r} among {len(names)} cells.",
            hint=did_you_mean(given, names).strip() or "`tactbench leaderboard --columns cell` lists the names.",
        )
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    raise UsageError(
        f"{given!r} is part of the names of {len(found)} cells.",
        hint=f"Give more of the name of one cell: {', '.join(found[:_SHOWN])}{more}.",
    )


def _replicate(name: str) -> tuple[str, int]:
    """Return the part of a cell's name that all its replicates share, and the seed of the replicate."""
    cell, _, seed = name.rpartition("/")
    return (cell, int(seed)) if seed.isdecimal() else (name, 0)
