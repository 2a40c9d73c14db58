"""Where what came with tactbench lies: the default matrix, matrices by name, results."""

from __future__ import annotations

from pathlib import Path

import tactbench
from tactbench.core.errors import ConfigError, UnknownNameError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml

_ENDINGS = (".yaml", ".yml")


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


def default_matrix() -> MatrixSpec:
    """Return ``benchmarks.yaml`` of this folder, else the one that came with tactbench; raises ConfigError."""
    own = Path("benchmarks.yaml")
    return load_yaml(own if own.is_file() else shipped(own.name, own.name), MatrixSpec)


def packaged_matrices() -> dict[str, Path]:
    """Return the matrices that came with tactbench, by name."""
    return {path.stem: path for path in sorted(shipped("matrices", "examples/matrices").glob("*.yaml"))}


def shipped_results() -> Path:
    """Return the file of results that came with tactbench; raises ConfigError if the installation has lost it."""
    return shipped("results/default.json", "examples/results/default.json")


def matrix_called(given: str) -> MatrixSpec:
    """Return the matrix in the file `given`, or the packaged one of that name.

    Raises
    ------
    UnknownNameError
        If there is neither; the message lists the names.
    ConfigError
        If the file is wrong or cannot be read.
    """
    packaged = packaged_matrices()
    if given in packaged and not Path(given).is_file():
        return load_yaml(packaged[given], MatrixSpec)
    if Path(given).exists() or given.endswith(_ENDINGS) or len(Path(given).parts) > 1:
        return load_yaml(Path(given), MatrixSpec)
    raise UnknownNameError("packaged matrix", given, packaged)
