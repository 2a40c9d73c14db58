"""Files that a study reads: result folders, and the results and matrices installed with tactbench."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.errors import ConfigError, UnknownNameError, UsageError
from tactbench.core.leaderboard.table import over_all
from tactbench.core.leaderboard.table import table_of as table_of
from tactbench.core.matrix.store import Row, Store
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.row import ReplicatedRow
from tactbench.core.spec.yaml_file import load_yaml
from tactbench.core.statistics.replicates import over_replicates
from tactbench.core.tables.terminal import remark


def is_results(folder: Path) -> bool:
    """Return True if a folder contains the file of at least one cell."""
    return any((folder / "cells").glob("*.h5"))


def opened(folder: Path) -> Store:
    """Return the store of a result folder; raises UsageError if the folder contains no results."""
    if not is_results(folder):
        raise UsageError(f"There are no results in {folder}.", hint="Compute results with `tactbench run --out DIR`.")
    return Store(folder)


def shown_rows(store: Store) -> list[Row]:
    """Return one row for each cell of a folder and report unreadable files; raises UsageError if no row can be read."""
    rows = store.rows()
    for one in store.troubles:
        remark(f"Left out: {one}")
    if not rows:
        raise UsageError(f"No result in {store.folder} can be read.", hint="Run `tactbench run` again.")
    return over_all(store, rows)


def shipped(name: str, in_checkout: str) -> Path:
    """Return the path of a file installed with tactbench: `name` in the package, or `in_checkout` in a source checkout.

    Raises
    ------
    ConfigError
        If the file is missing in this installation.
    """
    package = Path(tactbench.__file__).parent
    for place in (package / name, package.parent / in_checkout):
        if place.exists():
            return place
    raise ConfigError(name, None, "the file is missing in this installation.", hint="Install tactbench again.")


def shipped_rows() -> tuple[list[dict[str, Any]], str]:
    """Return the rows of the results installed with tactbench, one for each cell, and a text on their origin.

    Raises
    ------
    ConfigError
        If their file is missing in this installation.
    """
    file = shipped("results/default.json", "examples/results/default.json")
    made = json.loads(file.read_text(encoding="utf-8"))
    unknown = ReplicatedRow(cell="", status="done").model_dump()
    origin = (
        f"the results that came with tactbench ({made['command']} of version {made['version']}, seed {made['seed']}, "
        f"{made['replicates']}; times of another machine)"
    )
    return over_replicates([unknown | row for row in made["rows"]]), origin


def packaged_matrices() -> dict[str, Path]:
    """Return the paths of the packaged matrices, by name."""
    return {path.stem: path for path in sorted(shipped("matrices", "examples/matrices").glob("*.yaml"))}


def matrix_called(given: str | Path | None = None) -> MatrixSpec:
    """Return the matrix in the file `given`, or the packaged matrix of this name; None: ``benchmarks.yaml``.

    Raises
    ------
    UnknownNameError
        If there is neither a file nor a packaged matrix of this name; the message lists the names.
    ConfigError
        If the file is invalid or cannot be read.
    """
    path = Path(given or "benchmarks.yaml")
    if given is None:  # this folder's own, else the one that came with tactbench
        return load_yaml(path if path.is_file() else shipped(path.name, path.name), MatrixSpec)
    packaged = packaged_matrices()
    if not path.is_file() and str(given) in packaged:
        path = packaged[str(given)]
    elif not path.exists() and path.suffix not in (".yaml", ".yml") and len(path.parts) == 1:
        raise UnknownNameError("packaged matrix", str(given), packaged)
    return load_yaml(path, MatrixSpec)
