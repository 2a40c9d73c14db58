"""What a calibration has found out, as far as a report needs to know it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class PredictiveRange:
    """Where the simulated twin can put one published number, over everything it cannot know."""

    task: str
    sensor: str
    estimator: str
    protocol: str
    published: float
    """The published number that it was held against; tells two of one task apart."""
    low: float
    high: float
    level: float
    """Share of the draws inside: 0.9."""
    use: Literal["fitted", "held out"]
    """Fitted: the number chose the draws. Held out: it did not, and the range is a prediction."""
    asks: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By parameter: where the draws lie that come near the number. Those narrower than their prior only."""


@dataclass(frozen=True)
class FindingFrequency:
    """How often a sentence of the paper comes out true."""

    name: str
    statement: str
    share: float
    """Of the draws, 0 … 1."""
    low: float
    high: float
    """95 % interval of `share`."""
    draws: int
    reference: str = ""
    remark: str = ""


@dataclass(frozen=True)
class Calibrated:
    """A calibration, for a report."""

    ranges: tuple[PredictiveRange, ...] = ()
    findings: tuple[FindingFrequency, ...] = ()
    notes: tuple[str, ...] = ()
    """How many draws, which were accepted, where the procedure is described."""

    def range_for(
        self, task: str, sensor: str, estimator: str, protocol: str, published: float
    ) -> PredictiveRange | None:
        """Return the range of a published number as one sensor's row stands beside it, or None."""
        wanted = (task, sensor, estimator, protocol, published)
        found = (
            one for one in self.ranges if (one.task, one.sensor, one.estimator, one.protocol, one.published) == wanted
        )
        return next(found, None)
