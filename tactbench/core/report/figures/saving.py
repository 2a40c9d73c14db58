"""A figure as PDF and PNG, the same bytes every time."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.files import replace_file
from tactbench.core.report.figures.sketch import Sketch
from tactbench.core.report.results import SavedFigure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PNG_DPI = 150
RASTER_DPI = 300
"""Of dense clouds of points inside a PDF."""
_WITHOUT_DATES: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None, "Creator": "tactbench", "Producer": None},
    "png": {"Software": None},
}
"""Nor with the version of what drew them: files differ only where figures do."""


def save(sketch: Sketch, folder: Path) -> SavedFigure:
    """Write both files, each whole, and return what was drawn; raises OSError."""
    png, pdf = write(sketch.figure, sketch.name, folder)
    return SavedFigure(sketch.name, sketch.title, sketch.caption, png, pdf, sketch.group.keys)


def write(figure: Figure, name: str, folder: Path) -> tuple[Path, Path]:
    """Write `figure` as PNG and PDF, each whole, and return their paths.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    contents = {}
    for ending, dpi in (("png", PNG_DPI), ("pdf", RASTER_DPI)):
        content = io.BytesIO()
        figure.savefig(content, format=ending, dpi=dpi, metadata=_WITHOUT_DATES[ending])
        contents[ending] = content.getvalue()
        figure.set_layout_engine("none")  # the first drawing has put everything in its place
    for ending, content_ in contents.items():
        replace_file(folder / f"{name}.{ending}", content_)
    return folder / f"{name}.png", folder / f"{name}.pdf"
