"""Where matrices and calibrations lie: the default ones, and matrices that come with tactbench by name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import tactbench
from tactbench.core.errors import ConfigError, UnknownNameError
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml

_ENDINGS = (".yaml", ".yml")

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


def packaged_matrices() -> dict[str, Path]:
    """Return the matrices that came with tactbench, by name."""
    package = Path(tactbench.__file__).parent
    for folder in (package / "matrices", package.parent / "examples" / "matrices"):
        if folder.is_dir():
            return {path.stem: path for path in sorted(folder.glob("*.yaml"))}
    return {}


def shipped_results() -> Path:
    """Return the file of results that came with tactbench; raises ConfigError if the installation has lost it."""
    package = Path(tactbench.__file__).parent
    places = (package / "results" / "default.json", package.parent / "examples" / "results" / "default.json")
    for place in places:
        if place.is_file():
            return place
    raise ConfigError(places[0].name, None, "tactbench was installed without its results.",
                      hint="Make some with `tactbench run --protocol deployable`.")  # fmt: skip


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
