"""Work-precision diagrams: their points by subject, the front of each, and a figure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.interfaces import CostPoint, CostStudy
from tactbench.core.progress import Progress

P = TypeVar("P")
SHARE = 1 / 3
"""Of an observable's noise: an error below it changes no score much."""
# Okabe and Ito's colours, told apart by people with any colour vision; shapes say the same again.
MARKS = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"), ("#E69F00", "v"), ("#56B4E9", "P"),
         ("#000000", "X"), ("#F0E442", "h"))  # fmt: skip


def front(points: Sequence[P], *, seconds: Callable[[P], float], error: Callable[[P], float]) -> list[P]:
    """Return the points that no other one beats in both, the quickest first.

    Parameters
    ----------
    seconds
        What one takes; any unit, smaller is better.
    error
        How far off one is; smaller is better. A score to be maximised is given with its sign changed.
    """
    kept: list[P] = []
    for point in sorted(points, key=lambda point: (seconds(point), error(point))):
        if not kept or error(point) < error(kept[-1]):
            kept.append(point)
    return kept


class Skipped(NamedTuple):
    """A way that a sensor cannot have."""

    subject: str
    label: str
    rung: str
    """Name of the rung that it is; empty: none."""
    reason: str


def measured(study: CostStudy, subject: str, progress: Progress) -> Iterator[CostPoint | Skipped]:
    """Carry out the jobs of a study; yield its points as they come, and of what its subject cannot have why not."""
    progress.begin(subject, len(study.jobs))
    for job in study.jobs:
        progress.working(job.label)
        try:
            yield from job.run()
        except TactbenchError as error:
            yield Skipped(subject, job.label, job.rung, str(error))
        progress.advance(job.label)


def diagrams(points: Sequence[CostPoint]) -> dict[tuple[str, str], list[CostPoint]]:
    """Return the points by (subject, observable), each diagram's in order of their time."""
    found: dict[tuple[str, str], list[CostPoint]] = {}
    for point in points:
        found.setdefault((point.subject, point.observable), []).append(point)
    return {key: sorted(group, key=lambda point: point.seconds) for key, group in found.items()}


def precise(points: Sequence[CostPoint]) -> list[CostPoint]:
    """Return the front of one diagram: error against seconds."""
    return front(points, seconds=lambda point: point.seconds, error=lambda point: point.error)


def quickest_enough(points: Sequence[CostPoint]) -> CostPoint | None:
    """Return the quickest point of one diagram below a third of its noise; None: none, or no noise is stated."""
    enough = [point for point in points if math.isfinite(point.floor) and point.error < SHARE * point.floor]
    return min(enough, key=lambda point: point.seconds, default=None)


def draw(points: Sequence[CostPoint], title: str, paths: Sequence[Path]) -> None:
    """Draw one panel for each subject and observable, and save it under every one of `paths`.

    Points that share the setting ``family`` share a mark; the front is a line, the default a ring, and the dashed
    line a third of the observable's noise.
    """
    from matplotlib.figure import Figure

    panels = diagrams(points)
    across = min(2, len(panels))
    down = math.ceil(len(panels) / across)
    figure = Figure(figsize=(6.4 * across, 4.6 * down), layout="constrained")
    axes = figure.subplots(down, across, squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)

    def mark(axis: Any, own: Sequence[CostPoint], shape: str, **more: Any) -> None:
        axis.loglog([p.seconds for p in own], [max(p.error, 1e-12) for p in own], shape, **more)

    for axis, ((subject, observable), group) in zip(axes.flat, panels.items(), strict=False):
        families = list(dict.fromkeys(str(point.settings.get("family", "")) for point in group))
        for family, (colour, shape) in zip(families, MARKS, strict=False):
            own = [point for point in group if str(point.settings.get("family", "")) == family]
            mark(axis, own, shape, color=colour, ms=6, label=family)
        mark(axis, precise(group), "-", color="#555555", lw=1, zorder=0)
        mark(axis, [p for p in group if p.default], "o", ms=15, mfc="none", mec="black", mew=1.6, label="default")
        if math.isfinite(group[0].floor):
            axis.axhline(SHARE * group[0].floor, color="black", ls="--", lw=0.9, label="a third of the noise")
        axis.set(
            title=f"{subject}, {observable}", xlabel="seconds per recording", ylabel=f"error, rms [{group[0].unit}]"
        )
        axis.grid(True, which="major", alpha=0.3)
        axis.legend(fontsize=8, frameon=False)
    figure.suptitle(title)
    for path in paths:
        figure.savefig(path, dpi=150)
