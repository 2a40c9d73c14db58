"""What accuracy costs in time: one point of a work-precision diagram."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from tactbench.core.spec.recording import Scalar


@dataclass(frozen=True)
class CostPoint:
    """One way of computing something: what it takes, and how far off it is."""

    subject: str
    """What is computed for: a sensor."""
    observable: str
    """What is looked at: a kind of channel."""
    label: str
    """Short name of the way: ``default, 48 x 64, 16 nodes``."""
    seconds: float
    """Median time of one piece of work, as the diagram's title says."""
    error: float
    """Root mean square of the difference to the reference."""
    worst: float
    """Largest difference."""
    unit: str
    floor: float
    """Standard deviation of the noise the observable has anyway; infinity where it has none."""
    default: bool = False
    """This is what users get who ask for nothing."""
    rung: str = ""
    """Name of the rig's rung that this way is; empty: it is none."""
    settings: Mapping[str, Scalar] = field(default_factory=dict)
    """What was set."""


class CostJob(NamedTuple):
    """One way still to be measured."""

    label: str
    run: Callable[[], list[CostPoint]]
    """Raises a TactbenchError if this sensor cannot have it: the reason becomes a row."""
    rung: str = ""
    """As CostPoint's."""


class CostStudy(NamedTuple):
    """A diagram in the making: what its points mean, and how to get them."""

    title: str
    reference: str
    """What the errors are measured against, in one sentence."""
    jobs: Sequence[CostJob]
    """In order; the reference is computed with the first."""
