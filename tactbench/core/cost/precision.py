"""Work-precision diagrams: errors against computing times, and the front of the best points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.interfaces import CostPoint, CostStudy
from tactbench.core.progress import Progress

P = TypeVar("P")
SHARE = 1 / 3
"""Share of an observable's noise below which an error changes scores little."""


def front(points: Sequence[P], cost_of: Callable[[P], tuple[float, float]]) -> list[P]:
    """Return the points that no other point beats in both time and error, by increasing time.

    Parameters
    ----------
    cost_of
        Function that returns the time and the error of a point; smaller is better for both.
    """
    kept: list[P] = []
    for point in sorted(points, key=cost_of):
        if not kept or cost_of(point)[1] < cost_of(kept[-1])[1]:
            kept.append(point)
    return kept


class Skipped(NamedTuple):
    """A setting of the simulation that is not possible for a sensor, with the reason."""

    subject: str
    label: str
    reason: str


def measured(study: CostStudy, subject: str, progress: Progress) -> Iterator[CostPoint | Skipped]:
    """Carry out the jobs of a cost study; yield the measured points, and `Skipped` for jobs that are not possible."""
    progress.begin(subject, len(study.jobs))
    for job in study.jobs:
        progress.working(job.label)
        try:
            yield from job.run()
        except TactbenchError as error:
            yield Skipped(subject, job.label, str(error))
        progress.advance(job.label)


def diagrams(points: Sequence[CostPoint]) -> dict[tuple[str, str], list[CostPoint]]:
    """Return the points of each diagram by (subject, observable), sorted by time."""
    found: dict[tuple[str, str], list[CostPoint]] = {}
    for point in points:
        found.setdefault((point.subject, point.observable), []).append(point)
    return {key: sorted(group, key=lambda point: point.seconds) for key, group in found.items()}


def precise(points: Sequence[CostPoint]) -> list[CostPoint]:
    """Return the front of a diagram: points that no other beats in both seconds and error."""
    return front(points, lambda point: (point.seconds, point.error))
