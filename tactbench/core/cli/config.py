"""Where the default matrix lies."""

from __future__ import annotations

from pathlib import Path

import tactbench
from tactbench.core.errors import ConfigError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml


def default_matrix() -> MatrixSpec:
    """Return ``benchmarks.yaml`` of this folder, else the one that came with tactbench.

    Raises
    ------
    ConfigError
        If the file is wrong, or the installation has lost it.
    """
    package = Path(tactbench.__file__).parent
    places = (Path("benchmarks.yaml"), package / "benchmarks.yaml", package.parent / "benchmarks.yaml")
    for place in places:
        if place.is_file():
            return load_yaml(place, MatrixSpec)
    raise ConfigError("benchmarks.yaml", None, "is not here, and tactbench was installed without it.",
                      hint="Give a matrix with --config FILE.")  # fmt: skip
