"""Work-precision diagrams: their points by subject, and the front of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.interfaces import CostPoint, CostStudy
from tactbench.core.progress import Progress

P = TypeVar("P")
SHARE = 1 / 3
"""Share of an observable's noise; a smaller error changes scores little."""


def front(points: Sequence[P], cost_of: Callable[[P], tuple[float, float]]) -> list[P]:
    """Return the points that no other point beats in both time and error, in order of time.

    Parameters
    ----------
    cost_of
        Function that returns the time and the error of a point, both the smaller the better.
    """
    kept: list[P] = []
    for point in sorted(points, key=cost_of):
        if not kept or cost_of(point)[1] < cost_of(kept[-1])[1]:
            kept.append(point)
    return kept


class Skipped(NamedTuple):
    """A way of simulating that is not possible for a sensor."""

    subject: str
    label: str
    rung: str
    """Name of the rung; empty: none."""
    reason: str


def measured(study: CostStudy, subject: str, progress: Progress) -> Iterator[CostPoint | Skipped]:
    """Carry out the jobs of a study; yield their points, and the reasons of jobs that are not possible."""
    progress.begin(subject, len(study.jobs))
    for job in study.jobs:
        progress.working(job.label)
        try:
            yield from job.run()
        except TactbenchError as error:
            yield Skipped(subject, job.label, job.rung, str(error))
        progress.advance(job.label)


def diagrams(points: Sequence[CostPoint]) -> dict[tuple[str, str], list[CostPoint]]:
    """Return the points by (subject, observable), those of each diagram in order of their time."""
    found: dict[tuple[str, str], list[CostPoint]] = {}
    for point in points:
        found.setdefault((point.subject, point.observable), []).append(point)
    return {key: sorted(group, key=lambda point: point.seconds) for key, group in found.items()}


def precise(points: Sequence[CostPoint]) -> list[CostPoint]:
    """Return the front of one diagram: error against seconds."""
    return front(points, lambda point: (point.seconds, point.error))
