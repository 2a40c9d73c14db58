"""Draws every figure of a result folder; one that cannot be made stops no other."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from tactbench.core.errors import error_text
from tactbench.core.progress import Progress
from tactbench.core.report.figures.classification import confusion, embedding
from tactbench.core.report.figures.group import Group, Sketch, groups
from tactbench.core.report.figures.published_and_ours import draw_published
from tactbench.core.report.figures.regression import prediction_against_time, residuals
from tactbench.core.report.figures.style import save, styled
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.spec.task import VectorTarget

FIGURES: dict[str, tuple[Callable[[Group], Sketch], ...]] = {
    "regression": (prediction_against_time, residuals),
    "vector": (residuals,),
    "classification": (confusion, embedding),
}
"""Figures by kind of task, in the order of a report; NotApplicable is raised for a group that has no such figure."""


def draw_figures(
    results: Results, folder: Path, progress: Progress, remark: Callable[[str], None]
) -> list[SavedFigure]:
    """Draw every figure that the results allow and save it into `folder` as PDF and PNG.

    `remark` is called with a sentence on each figure that is left out.

    Returns
    -------
    list of SavedFigure
        In the order of a report: published scores and ours, then by group of comparable cells.
    """
    work: list[tuple[str, Callable[[], Sketch | None]]] = []
    for group in groups(results, remark):
        kind = "vector" if isinstance(group.task.target, VectorTarget) else group.task.kind
        where = f"of {group.task.name} under {group.row['protocol']}, split {group.row['split']}"
        work += [(f"{draw.__name__.replace('_', ' ')} {where}", partial(draw, group)) for draw in FIGURES.get(kind, ())]
    if work:
        work.insert(0, ("picture of published scores and ours", partial(draw_published, results)))
    drawn: list[SavedFigure] = []
    progress.begin("drawing", len(work))
    with styled():
        for name, draw in work:
            progress.working(name)
            try:
                sketch = draw()
                if sketch is not None:
                    picture = save(sketch.figure, folder / sketch.name)
                    drawn.append(SavedFigure(sketch.name, sketch.title, sketch.caption, picture))
            except Exception as error:  # stops no other figure
                remark(f"No {name}: {error_text(error)}")
            progress.advance(name)
    return drawn
