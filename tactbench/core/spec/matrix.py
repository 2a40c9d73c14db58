"""Model of ``benchmarks.yaml``: sensors, tasks, and settings for running every sensor with every task."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Simulation

# Larger numbers in the settings of a run are typing errors, and would overflow.
MOST_REPEATS = 1000
"""Largest number of replicates. Each replicate is recorded anew; the 95 % interval of the mean of 1000 is within 6 %
of their standard deviation."""
MOST_SECONDS = 366 * 86400.0
"""Largest time limit of a cell or a recording [s]: a year."""
MOST_MEMORY_MB = 2**30
"""Largest memory limit of a cell or a recording [MB of 2**20 bytes]: a pebibyte."""


def _by_name(given: Any) -> Any:
    """Return a text as ``{name: text}``, and any other value unchanged."""
    return {"name": given} if isinstance(given, str) else given


def _names(given: Any) -> Any:
    """Return a text as a tuple of one text, None as an empty tuple, and any other value unchanged."""
    if given is None:
        return ()
    return (given,) if isinstance(given, str) else given


REPLICATES = 8
"""Default number of replicates of a simulated cell; with so many, an outlier hardly moves a 95 % interval."""

Names = Annotated[tuple[str, ...], BeforeValidator(_names)]
"""One name, or a list of names, in a matrix file."""


class EstimatorChoice(Frozen):
    """An estimator by name, with those parameters that differ from its defaults."""

    name: str
    params: dict[str, bool | int | float | str | None] = Field(default_factory=dict)


class TaskChoice(Frozen):
    """A task by name, with the protocols, splits and estimators to evaluate on it."""

    name: str
    protocol: Names = ()
    """Names of protocols, each evaluated in cells of its own; empty: the first protocol of the task."""
    split: Names = ()
    """Names of splits, each evaluated in cells of its own; empty: the task's first split that the recordings can serve.
    `few-shot` stands for all of the task's splits `few-shot-N`."""
    estimators: tuple[Annotated[EstimatorChoice, BeforeValidator(_by_name)], ...] | None = None
    """Estimators to run beside the baselines, which are always run; None: the task's default estimators."""
    dataset: str | None = None
    """Name or mapping file of a public data set to use for this task instead of the matrix's recordings."""


class MatrixSpec(Frozen):
    """The benchmark matrix: every sensor with every task, and the settings of the run."""

    version: Literal[1] = 1
    seed: int = Field(default=1, ge=0)
    repeats: int | None = Field(default=None, ge=1, le=MOST_REPEATS)
    """Number of replicates of each cell, each recorded and evaluated with another seed. None: eight on a simulated rig;
    one on recordings, whose sessions then serve as replicates."""
    rig: str = ""
    """Name of the rig; empty: see :meth:`~tactbench.core.plugins.registry.Registry.first_rig` (kind simulated)."""
    recordings: str | None = None
    """Folder of recordings for rigs that replay, relative to the working directory."""
    rig_file: str | None = None
    """Rig file (:class:`~tactbench.core.spec.rig_file.RigFile`) of devices, relative to the working directory."""
    timeout_s: float | None = Field(default=None, gt=0, le=MOST_SECONDS)
    """Time limit of a cell or of a recording [s]."""
    memory_mb: int | None = Field(default=None, ge=1, le=MOST_MEMORY_MB)
    """Most memory that a cell or a recording may use beyond the memory that all processes share [MB of 2**20 bytes]."""
    probe: bool = False
    """True if extra cells are run that reveal leaks in recordings; see docs/real-recordings.md."""
    latency: bool = True
    """True if the time of a single prediction is measured, which takes up to 0.3 s for each cell."""
    include_incomplete: bool = False
    """True if incomplete recordings, which lack more rows than their rig file allows, are used as well."""
    simulation: Simulation = Simulation()
    """Settings with which a simulated rig carries out all scenes."""
    sensors: tuple[str, ...] = ()
    """Names of sensors; empty: all sensors of which the rig has recordings."""
    tasks: tuple[Annotated[TaskChoice, BeforeValidator(_by_name)], ...] = Field(min_length=1)
