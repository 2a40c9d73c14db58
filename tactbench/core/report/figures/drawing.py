"""Draws every figure that a result folder can serve; one that cannot be made stops no other."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tactbench.core.errors import error_text
from tactbench.core.files import replace_file
from tactbench.core.progress import Progress
from tactbench.core.report.figures import (
    confusion,
    embedding_map,
    location_map,
    prediction_against_time,
    residuals,
    score_by_force,
)
from tactbench.core.report.figures.group import Group, Sketch, groups
from tactbench.core.report.figures.published_and_ours import draw_published
from tactbench.core.report.figures.style import styled
from tactbench.core.report.results import Results, SavedFigure
from tactbench.core.spec.task import VectorTarget

FIGURES: dict[str, tuple[Callable[[Group], Sketch], ...]] = {
    "regression": (prediction_against_time.draw, residuals.draw),
    "vector": (location_map.draw, residuals.draw),
    "classification": (confusion.draw, score_by_force.draw, embedding_map.draw),
}
"""By kind of task, vectors apart, in the order of a report; each raises NotApplicable where it does not apply."""

PNG_DPI, RASTER_DPI = 150, 300
"""Of a picture, and of dense clouds of points inside a PDF."""


def draw_figures(
    results: Results, folder: Path, progress: Progress, remark: Callable[[str], None]
) -> list[SavedFigure]:
    """Draw and save every figure that the results can serve, as PDF and PNG.

    Parameters
    ----------
    folder
        Where the files go. Nothing else is written into it.
    progress
        Where progress goes.
    remark
        Called with a sentence on each figure that is left out.

    Returns
    -------
    list of SavedFigure
        In the order of a report: published scores and ours, then by group of comparable cells, as the cells come.
    """
    work: list[tuple[str, str, Callable[[], Sketch | None]]] = []  # what is drawn, of which cells, and by what
    for group in groups(results, remark):
        kind = "vector" if isinstance(group.task.target, VectorTarget) else group.task.kind
        where = f" under {group.row['protocol']}, split {group.row['split']}"
        for draw in FIGURES.get(kind, ()):
            name = draw.__module__.rpartition(".")[2].replace("_", " ")
            work.append((f"{name} of {group.task.name}", where, partial(draw, group)))
    if work:
        work.insert(0, ("picture of published scores and ours", "", partial(draw_published, results)))
    drawn: list[SavedFigure] = []
    progress.begin("drawing", len(work))
    with styled():
        for what, where, make in work:
            progress.working(what)
            try:
                sketch = make()
                if sketch is not None:
                    drawn.append(save(sketch, folder))
            except Exception as error:  # stops no other figure
                why = error_text(error)
                remark(f"No {what}{where}: {why}")
            progress.advance(what)
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
