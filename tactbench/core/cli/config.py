"""Where the default matrix and the default calibration lie."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import tactbench
from tactbench.core.errors import ConfigError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml

if TYPE_CHECKING:
    from tactbench.core.spec.calibration import CalibrationSpec


def default_matrix() -> MatrixSpec:
    """Return ``benchmarks.yaml`` of this folder, else the one that came with tactbench.

    Raises
    ------
    ConfigError
        If the file is wrong, or the installation has lost it.
    """
    return load_yaml(_default("benchmarks.yaml", "matrix"), MatrixSpec)


def default_calibration() -> CalibrationSpec:
    """Return ``calibration.yaml`` of this folder, else the one that came with tactbench; raises ConfigError."""
    from tactbench.core.spec.calibration import CalibrationSpec

    return load_yaml(_default("calibration.yaml", "procedure"), CalibrationSpec)


def _default(name: str, what: str) -> Path:
    package = Path(tactbench.__file__).parent
    for place in (Path(name), package / name, package.parent / name):
        if place.is_file():
            return place
    raise ConfigError(name, None, "is not here, and tactbench was installed without it.",
                      hint=f"Give a {what} with --config FILE.")  # fmt: skip
