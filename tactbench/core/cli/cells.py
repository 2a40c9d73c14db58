"""Which cell of a result folder a verb is about, and what there is of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.errors import UsageError

if TYPE_CHECKING:
    from tactbench.core.matrix.keys import Keys
    from tactbench.core.matrix.plan import Cell
    from tactbench.core.matrix.store import Row, Store
    from tactbench.core.matrix.why import Explanation
    from tactbench.core.plugins.registry import Registry


@dataclass(frozen=True)
class StoredCell:
    """One cell, and how it was answered."""

    store: Store
    registry: Registry
    keys: Keys
    cell: Cell
    row: Row
    paths: tuple[Path, ...]
    simulated: bool
    """Whether its recordings can be made anew."""

    def explain(self) -> Explanation:
        """Return whether its result would be reused, and what differs."""
        from tactbench.core.matrix.why import explain

        return explain(self.cell, self.paths, self.keys, self.store, self.row)


def find_cell(out: Path, given: str) -> StoredCell:
    """Return the cell of the result folder `out` whose name, or a part of it, is `given`.

    Raises
    ------
    UsageError
        If there is no such folder or cell, or more than one cell is meant.
    """
    from tactbench.core.matrix.keys import Keys
    from tactbench.core.matrix.naming import cell_of, meant
    from tactbench.core.matrix.plan_recordings import request_key, requests_for
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.declared import with_declared_of
    from tactbench.core.plugins.registry import installed

    if not out.is_dir():
        what = f"{out} is no folder" if out.exists() else f"There is no folder {out}"
        raise UsageError(f"{what}.", hint="Name one that `tactbench run --out DIR` wrote.")
    store = Store(out)
    rows = {row["cell"]: row for row in store.rows()}
    registry = with_declared_of(installed(), rows.values())
    keys = Keys(registry)
    try:
        row = rows[meant(given, list(rows))]
    except UsageError as error:
        lost = [text for text in store.troubles if given in text]
        if lost:
            raise UsageError(f"{lost[0]}.", hint="The next run of its matrix computes it again.") from error
        raise
    cell = cell_of(row)
    simulated = registry.rigs[cell.rig].simulated
    if simulated:
        made = requests_for([cell], registry, keys, store, cell.simulation)[request_key(cell)]
        paths = tuple(request.path for request in made)
    else:
        paths = _recordings_of(row, store)
    return StoredCell(store, registry, keys, cell, row, paths, simulated)


def _recordings_of(row: Mapping[str, Any], store: Store) -> tuple[Path, ...]:
    """Return the files that a row was answered from; raises UsageError if one of them is not there."""
    found = []
    for path, file in store.recordings(row):
        if file is None:
            raise UsageError(
                f"The recording {path} is not there.",
                hint="Run the matrix again with --rig replay --recordings DIR.",
            )
        found.append(file)
    return tuple(found)
