"""What came with tactbench, and matrices by name."""

from __future__ import annotations

from pathlib import Path

import tactbench
from tactbench.core.errors import ConfigError, UnknownNameError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml


def shipped(name: str, in_checkout: str) -> Path:
    """Return what came with tactbench: `name` in the installed package, or `in_checkout` in a checkout of it.

    Raises
    ------
    ConfigError
        If the installation has lost it.
    """
    package = Path(tactbench.__file__).parent
    for place in (package / name, package.parent / in_checkout):
        if place.exists():
            return place
    raise ConfigError(name, None, "tactbench was installed without it.", hint="Install tactbench again.")


def shipped_results() -> Path:
    """Return the file of results that came with tactbench; raises ConfigError if the installation has lost it."""
    return shipped("results/default.json", "examples/results/default.json")


def packaged_matrices() -> dict[str, Path]:
    """Return the matrices that came with tactbench, by name."""
    return {path.stem: path for path in sorted(shipped("matrices", "examples/matrices").glob("*.yaml"))}


def matrix_called(given: str | Path | None = None) -> MatrixSpec:
    """Return the matrix in the file `given`, or the packaged one of that name; None: ``benchmarks.yaml``.

    Raises
    ------
    UnknownNameError
        If there is neither; the message lists the names.
    ConfigError
        If the file is wrong or cannot be read.
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
