"""Draws every figure that a result folder can serve; one that cannot be made stops no other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.evaluation.protocols import shots
from tactbench.core.matrix.progress import Progress
from tactbench.core.report.figures import (
    confusion,
    embedding_map,
    latency_and_false_alarms,
    location_map,
    one_event,
    prediction_against_time,
    residuals,
    score_by_force,
    validation_curve,
)
from tactbench.core.report.figures.few_shot import draw_few_shot
from tactbench.core.report.figures.group import Group, Remark, groups
from tactbench.core.report.figures.published_and_ours import draw_published
from tactbench.core.report.figures.saving import save
from tactbench.core.report.figures.sketch import Sketch
from tactbench.core.report.figures.style import styled
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.spec.task import TaskSpec, VectorTarget

Draw = Callable[[Group, Remark], Sketch]
"""A group of cells to a figure; raises NotApplicable where it does not apply, and tells of panels it leaves out."""

FIGURES: dict[str, tuple[Draw, ...]] = {
    "regression": (prediction_against_time.draw, residuals.draw, validation_curve.draw),
    "vector": (location_map.draw, residuals.draw, validation_curve.draw),
    "events": (one_event.draw, latency_and_false_alarms.draw),
    "classification": (confusion.draw, score_by_force.draw, embedding_map.draw, validation_curve.draw),
}
"""By kind of task, vectors apart, in the order of a report."""


def draw_figures(
    results: Results, folder: Path, progress: Progress | None = None, remark: Remark | None = None
) -> list[SavedFigure]:
    """Draw and save every figure that the results can serve, as PDF and PNG.

    Parameters
    ----------
    results
        The results.
    folder
        Where the files go; made if it is not there. Nothing else is written into it.
    progress
        Told what is being drawn.
    remark
        Told what is left out, and why: a sentence each.

    Returns
    -------
    list of SavedFigure
        In the order of a report: published scores and ours, then by group of comparable cells, as the cells come.

    Raises
    ------
    UsageError
        If `folder` cannot be made.
    """
    reporter = progress or Progress()
    say: Remark = remark or (lambda _: None)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"The folder {folder} cannot be made: {error.strerror}.", hint="Give another one.") from error
    work = [(group, draw) for group in _worth_drawing(results, say) for draw in _figures_of(group.task)]
    refused: dict[tuple[str, str], list[str]] = {}
    if not work:
        return []
    drawn: list[SavedFigure] = []
    try:
        drawn += draw_published(results, folder)
    except Exception as error:
        say(f"No picture of published scores and ours: {type(error).__name__}: {error}")
    reporter.begin("drawing", len(work))
    with styled():
        for group, draw in work:
            what = f"{draw.__module__.rpartition('.')[2].replace('_', ' ')} of {group.task.name}"
            reporter.working(what)
            try:
                sketch = draw(group, say)
                drawn.append(save(sketch, folder))
            except Exception as error:
                why = str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {error}"
                refused.setdefault((what, why), []).append(f"{group.row['protocol']}, split {group.row['split']}")
            reporter.advance(what)
    for (what, why), where in refused.items():
        say(f"No {what} under {'; '.join(where)}: {why}")
    try:
        drawn += draw_few_shot(results, folder)
    except Exception as error:
        say(f"No figure of few sessions: {type(error).__name__}: {error}")
    return drawn


def _figures_of(task: TaskSpec) -> tuple[Draw, ...]:
    return FIGURES["vector" if isinstance(task.target, VectorTarget) else task.kind]


def _worth_drawing(results: Results, say: Remark) -> list[Group]:
    """Return the groups of cells, few-shot splits left to the one figure that shows them all."""
    found = groups(results, say)
    few = [group for group in found if shots(group.row["split"])]
    return [group for group in found if len(few) < 2 or group not in few]
