"""Work-precision diagrams: their points by subject, the front of each, and the default's place in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from tactbench.core.cost.front import front
from tactbench.core.errors import TactbenchError
from tactbench.core.matrix.progress import Progress
from tactbench.core.plugins.cost import CostPoint, CostStudy


class Skipped(NamedTuple):
    """A way that a sensor cannot have."""

    subject: str
    label: str
    rung: str
    """Name of the rung that it is; empty: none."""
    reason: str


def measured(study: CostStudy, subject: str, progress: Progress) -> tuple[list[CostPoint], list[Skipped]]:
    """Carry out the jobs of a study, and say of those that its subject cannot have why not."""
    points: list[CostPoint] = []
    skipped: list[Skipped] = []
    progress.begin(subject, study.total)
    for job in study.jobs:
        progress.working(job.label)
        try:
            points += job.run()
        except TactbenchError as error:
            skipped.append(Skipped(subject, job.label, job.rung, str(error)))
        progress.advance(job.label)
    return points, skipped


def diagrams(points: Sequence[CostPoint]) -> dict[tuple[str, str], list[CostPoint]]:
    """Return the points by (subject, observable), each diagram's in order of their time."""
    found: dict[tuple[str, str], list[CostPoint]] = {}
    for point in points:
        found.setdefault((point.subject, point.observable), []).append(point)
    return {key: sorted(group, key=lambda point: point.seconds) for key, group in found.items()}


def precise(points: Sequence[CostPoint]) -> list[CostPoint]:
    """Return the front of one diagram: error against seconds."""
    return front(points, seconds=lambda point: point.seconds, error=lambda point: point.error)


def cheapest_below(points: Sequence[CostPoint], share: float = 1 / 3) -> CostPoint | None:
    """Return the quickest point of one diagram whose error is below `share` of the noise; None if none is."""
    below = [point for point in points if math.isfinite(point.floor) and point.error < share * point.floor]
    return min(below, key=lambda point: point.seconds, default=None)


def verdict(points: Sequence[CostPoint], share: float = 1 / 3) -> str:
    """Return one sentence on the default's place in one diagram: why it is the default, or what it misses."""
    default = next((point for point in points if point.default), None)
    if default is None:
        return "No default is among the points."
    subject = f"{default.subject}, {default.observable}"
    at = f"the default ({default.label}) is off by {default.error:.2g} {default.unit} rms at {_time(default)}"
    if not math.isfinite(default.floor):
        return f"{subject}: {at}; no noise is stated to hold it against."
    limit = f"a third of the noise ({share * default.floor:.2g} {default.unit})"
    best = cheapest_below(points, share)
    if best is None:
        closest = min(points, key=lambda point: point.error)
        return (
            f"{subject}: {at}; no point keeps {limit}: the nearest, {closest.label}, is off by {closest.error:.2g} "
            f"at {_time(closest)}."
        )
    # Two times within a tenth of each other are one time on a machine that does other things as well.
    if default.error < share * default.floor and default.seconds <= 1.1 * best.seconds:
        return f"{subject}: {at}: the cheapest point below {limit}."
    if default.error < share * default.floor:
        return f"{subject}: {at}, below {limit}; {best.label} keeps it too, in {_time(best)}."
    return f"{subject}: {at}, above {limit}; {best.label} keeps it, in {_time(best)}."


def _time(point: CostPoint) -> str:
    return f"{1e3 * point.seconds:.0f} ms" if point.seconds < 1 else f"{point.seconds:.2g} s"
