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
    from tactbench.core.matrix.plan_recordings import RecordingRequest
    from tactbench.core.matrix.store import Row, Store
    from tactbench.core.matrix.why import Explanation
    from tactbench.core.plugins.registry import Registry


@dataclass(frozen=True)
class StoredCell:
    """One cell, as it is asked now and as it was answered."""

    store: Store
    registry: Registry
    keys: Keys
    cell: Cell
    row: Row | None
    """What the folder says of it."""
    paths: tuple[Path, ...]
    requests: tuple[RecordingRequest, ...]
    """How the recordings are made; none if they were made elsewhere, or cannot be made anew."""

    def explain(self) -> Explanation:
        """Return whether its result would be reused, and what differs."""
        from tactbench.core.matrix.why import explain

        return explain(self.cell, self.paths, self.keys, self.store, self.row)


def find_cell(out: Path, given: str, options: Mapping[str, Any] | None = None) -> StoredCell:
    """Return the cell that a person means.

    Parameters
    ----------
    out
        The result folder.
    given
        The cell's name, or a part of it.
    options
        The selecting options, given or not: if one was given, the cell is looked for in the matrix that they ask for;
        otherwise among the folder's rows, and then in the default matrix. None: among the folder's rows only.

    Raises
    ------
    UsageError
        If there is no such folder or cell, or more than one cell is meant.
    """
    from tactbench.core.cli.selection import requested_matrix
    from tactbench.core.matrix.keys import Keys
    from tactbench.core.matrix.naming import cell_of, meant
    from tactbench.core.matrix.plan_recordings import plan_run, request_key
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.declared import declared_in, with_declared, with_declared_of
    from tactbench.core.plugins.registry import installed

    if not out.is_dir():
        what = f"{out} is no folder" if out.exists() else f"There is no folder {out}"
        raise UsageError(f"{what}.", hint="Name one that `tactbench run --out DIR` wrote.")
    store = Store(out)
    rows = {row["cell"]: row for row in store.rows()}
    registry = with_declared_of(installed(), rows.values())
    keys = Keys(registry)
    if options is None or not any(_given(name, value) for name, value in options.items()):
        try:
            row = rows[meant(given, list(rows))]
        except UsageError as error:
            lost = [text for text in store.troubles if given in text]
            if lost:
                raise UsageError(f"{lost[0]}.", hint="The next run of its matrix computes it again.") from error
            if options is None or any(given in name for name in rows):
                raise
        else:
            cell = cell_of(row)
            paths, requests = _recordings_and_requests(cell, row, registry, keys, store)
            return StoredCell(store, registry, keys, cell, row, paths, requests)
    selection = dict(options or {})
    if not selection["config"] and any(given in name for name in rows):
        given = meant(given, list(rows))
        # The options change how the cell was asked; what they do not mention stays.
        was = {"sensors": (rows[given]["sensor"],), "tasks": (rows[given]["task"],), "rig": rows[given]["rig"]}
        selection |= {name: value for name, value in was.items() if not selection[name]}
    matrix, folder = requested_matrix(registry, **selection)
    if folder is not None:
        registry = with_declared(installed(), declared_in(folder))
        keys = Keys(registry)
    cells, needed = plan_run(matrix, registry, keys, store, folder)
    cell = {one.name: one for one in cells}[meant(given, [one.name for one in cells])]
    need = request_key(cell)
    paths, made = tuple(needed.paths.get(need, ())), tuple(needed.requests.get(need, ()))
    return StoredCell(store, registry, keys, cell, rows.get(cell.name), paths, made)


def _given(option: str, value: Any) -> bool:
    return bool(value) if option == "probe" else value is not None and value != ()


def _recordings_and_requests(
    cell: Cell, row: Row, registry: Registry, keys: Keys, store: Store
) -> tuple[tuple[Path, ...], tuple[RecordingRequest, ...]]:
    """Return the recordings a row was answered from, and how to make them where a simulation did."""
    from tactbench.core.matrix.plan_recordings import request_key, requests_for

    if registry.rigs[cell.rig].simulated:
        made = requests_for([cell], registry, keys, store, cell.simulation)[request_key(cell)]
        return tuple(request.path for request in made), tuple(made)
    return recordings_of(row, store), ()


def recordings_of(row: Mapping[str, Any], store: Store) -> tuple[Path, ...]:
    """Return the files that a row was answered from.

    Raises
    ------
    UsageError
        If one of them is not there.
    """
    found = []
    for path, file in store.recordings(row):
        if file is None:
            raise UsageError(
                f"The recording {path} is not there.",
                hint="Run the matrix again with --rig replay --recordings DIR.",
            )
        found.append(file)
    return tuple(found)
