"""What ``benchmarks.yaml`` says: which tasks are asked of which sensors, and how."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from tactbench.core.spec.bounds import MOST_MEMORY_MB, MOST_REPEATS, MOST_SECONDS
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Simulation


def _by_name(given: Any) -> Any:
    """Read a bare word as ``{name: word}``."""
    return {"name": given} if isinstance(given, str) else given


def _names(given: Any) -> Any:
    """Read a bare word as a list of one, and nothing as none."""
    if given is None:
        return ()
    return (given,) if isinstance(given, str) else given


REPLICATES = 8
"""Replicates of a simulated cell: with eight, one outlying replicate moves no end of the 95 % interval by much."""

Names = Annotated[tuple[str, ...], BeforeValidator(_names)]
"""A name, or a list of names."""


class EstimatorChoice(Frozen):
    """An estimator, with parameters other than its defaults."""

    name: str
    params: dict[str, bool | int | float | str | None] = Field(default_factory=dict)


class TaskChoice(Frozen):
    """A task, and how it is to be answered."""

    name: str
    protocol: Names = ()
    """One or several, each giving cells of its own; none: the task's first."""
    split: Names = ()
    """One or several, each giving cells of its own; none: the first of the task's splits that the recordings can serve.
    `few-shot` stands for all of the task's splits `few-shot-N`."""
    estimators: tuple[Annotated[EstimatorChoice, BeforeValidator(_by_name)], ...] | None = None
    """None: the task's own. Its baselines are always run, and alone where this is empty."""
    dataset: str | None = None
    """Name, or mapping file, of a public data set that is asked, whatever the matrix says of recordings."""


class ComparisonChoice(Frozen):
    """Two sensors or two estimators that the matrix is run to compare."""

    sensors: tuple[str, str] | None = None
    estimators: tuple[str, str] | None = None
    task: str | None = None
    """None: with every task that both have answered."""

    @model_validator(mode="after")
    def _one_kind_of_two(self) -> ComparisonChoice:
        pair = self.sensors or self.estimators
        if pair is None or (self.sensors and self.estimators):
            raise ValueError("a comparison is of two sensors or of two estimators: give one of them")
        if pair[0] == pair[1]:
            raise ValueError(f"{pair[0]!r} is compared with itself")
        return self


class MatrixSpec(Frozen):
    """The matrix: every sensor with every task."""

    version: Literal[1] = 1
    seed: int = Field(default=1, ge=0)
    repeats: int | None = Field(default=None, ge=1, le=MOST_REPEATS)
    """Replicates: how often everything is recorded and answered anew, each time with another seed. None: eight on a
    simulated rig; on recordings one, whose sessions are the replicates."""
    rig: str = ""
    """Empty: the simulated one (:meth:`~tactbench.core.plugins.registry.Registry.first_rig`)."""
    recordings: str | None = None
    """Folder of recordings for rigs that replay; relative to where tactbench is run."""
    rig_file: str | None = None
    """File of a rig of real or emulated devices (:class:`~tactbench.core.spec.rig_file.RigFile`); relative likewise."""
    timeout_s: float | None = Field(default=None, gt=0, le=MOST_SECONDS)
    """Seconds that one cell or one recording may take."""
    memory_mb: int | None = Field(default=None, ge=1, le=MOST_MEMORY_MB)
    """MB (2**20 bytes) that one cell or one recording may take beyond what all share."""
    probe: bool = False
    """Also run the cells that show what recordings give away; see docs/real-recordings.md."""
    latency: bool = True
    """Measure how long one row takes, up to 0.3 s a cell; False: rows say nothing about it."""
    include_incomplete: bool = False
    """Let recordings of which more is missing than their rig file allows take part."""
    simulation: Simulation = Simulation()
    """How a simulated rig is asked to carry out every scene."""
    sensors: tuple[str, ...] = ()
    """Empty: all that the rig's recordings hold."""
    tasks: tuple[Annotated[TaskChoice, BeforeValidator(_by_name)], ...] = Field(min_length=1)
    comparisons: tuple[ComparisonChoice, ...] = ()
    """What is to be compared, said beforehand: p-values are corrected for being so many. All else is exploratory."""
