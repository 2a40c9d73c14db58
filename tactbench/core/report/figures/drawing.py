"""Draws every figure that a result folder can serve; one that cannot be made stops no other."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.files import replace_file
from tactbench.core.matrix.progress import Progress
from tactbench.core.report.figures import (
    confusion,
    embedding_map,
    latency_and_false_alarms,
    location_map,
    prediction_against_time,
    residuals,
    score_by_force,
)
from tactbench.core.report.figures.group import Group, Remark, Sketch, groups
from tactbench.core.report.figures.published_and_ours import draw_published
from tactbench.core.report.figures.style import styled
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.spec.task import VectorTarget

Draw = Callable[[Group, Remark], Sketch]
"""A group of cells to a figure; raises NotApplicable where it does not apply, and tells of panels it leaves out."""

FIGURES: dict[str, tuple[Draw, ...]] = {
    "regression": (prediction_against_time.draw, residuals.draw),
    "vector": (location_map.draw, residuals.draw),
    "events": (latency_and_false_alarms.draw,),
    "classification": (confusion.draw, score_by_force.draw, embedding_map.draw),
}
"""By kind of task, vectors apart, in the order of a report."""

PNG_DPI, RASTER_DPI = 150, 300
"""Of a picture, and of dense clouds of points inside a PDF."""


def draw_figures(
    results: Results, folder: Path, progress: Progress | None = None, remark: Remark | None = None
) -> list[SavedFigure]:
    """Draw and save every figure that the results can serve, as PDF and PNG.

    Parameters
    ----------
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
    work: list[tuple[str, str, Callable[[], Sketch | None]]] = []  # what is drawn, of which cells, and by what
    for group in groups(results, say):
        kind = "vector" if isinstance(group.task.target, VectorTarget) else group.task.kind
        for draw in FIGURES[kind]:
            what = f"{draw.__module__.rpartition('.')[2].replace('_', ' ')} of {group.task.name}"
            work.append(
                (what, f" under {group.row['protocol']}, split {group.row['split']}", partial(draw, group, say))
            )
    if not work:
        return []
    work.insert(0, ("picture of published scores and ours", "", partial(draw_published, results)))
    drawn: list[SavedFigure] = []
    refused: dict[tuple[str, str], list[str]] = {}
    reporter.begin("drawing", len(work))
    with styled():
        for what, where, make in work:
            reporter.working(what)
            try:
                sketch = make()
                if sketch is not None:
                    drawn.append(save(sketch, folder))
            except Exception as error:
                why = str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {error}"
                refused.setdefault((what, why), []).append(where)
            reporter.advance(what)
    for (what, why), places in refused.items():
        say(f"No {what}{';'.join(places)}: {why}")
    return drawn


def save(sketch: Sketch, folder: Path) -> SavedFigure:
    """Write a figure as PNG and PDF, each whole, without dates: the same figure is the same bytes."""
    # Without the version of what drew it either.
    apart = {"png": {"Software": None}, "pdf": {"CreationDate": None, "Creator": "tactbench", "Producer": None}}
    for ending, dpi in (("png", PNG_DPI), ("pdf", RASTER_DPI)):
        content = io.BytesIO()
        sketch.figure.savefig(content, format=ending, dpi=dpi, metadata=apart[ending])
        sketch.figure.set_layout_engine("none")  # the first drawing has put everything in its place
        replace_file(folder / f"{sketch.name}.{ending}", content.getvalue())
    return SavedFigure(sketch.name, sketch.title, sketch.caption, folder / f"{sketch.name}.png")
