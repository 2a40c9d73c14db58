"""Model of ``benchmarks.yaml``: sensors, tasks, and how their cells are run."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from tactbench.core.spec.bounds import MOST_MEMORY_MB, MOST_REPEATS, MOST_SECONDS
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Simulation


def _by_name(given: Any) -> Any:
    """Return a bare word as ``{name: word}``, and anything else as it is."""
    return {"name": given} if isinstance(given, str) else given


def _names(given: Any) -> Any:
    """Return a bare word as a tuple of one, and None as an empty one."""
    if given is None:
        return ()
    return (given,) if isinstance(given, str) else given


REPLICATES = 8
"""Default number of replicates of a simulated cell, at which one outlier hardly moves a 95 % interval."""

Names = Annotated[tuple[str, ...], BeforeValidator(_names)]
"""One name or a list of names."""


class EstimatorChoice(Frozen):
    """An estimator, with the parameters that differ from its defaults."""

    name: str
    params: dict[str, bool | int | float | str | None] = Field(default_factory=dict)


class TaskChoice(Frozen):
    """A task, with the protocols, splits and estimators that answer it."""

    name: str
    protocol: Names = ()
    """Protocols, each with cells of its own; empty: the first of the task."""
    split: Names = ()
    """Splits, each with cells of its own; empty: the task's first that the recordings can serve. `few-shot` stands for
    all of the task's splits `few-shot-N`."""
    estimators: tuple[Annotated[EstimatorChoice, BeforeValidator(_by_name)], ...] | None = None
    """Estimators beside the baselines, which are always run; None: those of the task."""
    dataset: str | None = None
    """Name or mapping file of a public data set for this task, in place of the recordings of the matrix."""


class ComparisonChoice(Frozen):
    """Two sensors or two estimators that are to be compared."""

    sensors: tuple[str, str] | None = None
    estimators: tuple[str, str] | None = None
    task: str | None = None
    """Task of the comparison; None: every task that both have answered."""

    @model_validator(mode="after")
    def _one_kind_of_two(self) -> ComparisonChoice:
        pair = self.sensors or self.estimators
        if pair is None or (self.sensors and self.estimators):
            raise ValueError("a comparison is of two sensors or of two estimators: give one of them")
        if pair[0] == pair[1]:
            raise ValueError(f"{pair[0]!r} is compared with itself")
        return self


class MatrixSpec(Frozen):
    """The matrix: every sensor with every task, and how cells are run."""

    version: Literal[1] = 1
    seed: int = Field(default=1, ge=0)
    repeats: int | None = Field(default=None, ge=1, le=MOST_REPEATS)
    """Number of replicates, each recorded and answered with another seed. None: eight on a simulated rig; one on
    recordings, whose sessions are the replicates."""
    rig: str = ""
    """Name of the rig; empty: the simulated one (:meth:`~tactbench.core.plugins.registry.Registry.first_rig`)."""
    recordings: str | None = None
    """Folder of recordings for rigs that replay, relative to the working directory."""
    rig_file: str | None = None
    """File of a rig of real or emulated devices (:class:`~tactbench.core.spec.rig_file.RigFile`), relative likewise."""
    timeout_s: float | None = Field(default=None, gt=0, le=MOST_SECONDS)
    """Longest time that a cell or a recording may take [s]."""
    memory_mb: int | None = Field(default=None, ge=1, le=MOST_MEMORY_MB)
    """Most memory that a cell or a recording may take beyond what all share [MB of 2**20 bytes]."""
    probe: bool = False
    """Whether cells are run that show leaks of recordings; see docs/real-recordings.md."""
    latency: bool = True
    """Whether the time of answering one row is measured, which takes up to 0.3 s a cell."""
    include_incomplete: bool = False
    """Whether recordings are used that lack more than their rig file allows."""
    simulation: Simulation = Simulation()
    """Settings with which a simulated rig carries out every scene."""
    sensors: tuple[str, ...] = ()
    """Names of sensors; empty: all of which the rig has recordings."""
    tasks: tuple[Annotated[TaskChoice, BeforeValidator(_by_name)], ...] = Field(min_length=1)
    comparisons: tuple[ComparisonChoice, ...] = ()
    """Comparisons that are planned in advance, whose p-values are corrected for their number."""
