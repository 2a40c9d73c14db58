"""Files installed with tactbench: results of the default matrix, and packaged matrices by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import tactbench
from tactbench.core.errors import ConfigError, UnknownNameError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.row import ReplicatedRow
from tactbench.core.spec.yaml_file import load_yaml
from tactbench.core.statistics.replicates import over_replicates


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
