"""The figures, with their captions."""

from __future__ import annotations

from tactbench.core.report.figures.published_and_ours import COLUMN
from tactbench.core.report.figures.published_and_ours import NAME as PUBLISHED
from tactbench.core.report.saved_figure import SavedFigure
from tactbench.core.report.section import Picture, ReportData, Section


def picture(one: SavedFigure, subject: ReportData) -> Picture:
    """Return a figure with the cells that it shows."""
    by_key = {row["key"]: row["cell"] for row in subject.rows if row["key"]}
    cells = tuple((by_key[key], subject.anchors[by_key[key]]) for key in one.keys if key in by_key)
    return Picture(one.title, one.caption, one.png.read_bytes(), cells)


def pictures_section(subject: ReportData) -> Section:
    """Return the section of figures: those that were drawn for this page."""
    drawn = [one for one in subject.drawn if one.name not in (PUBLISHED, COLUMN)]
    if not drawn:
        none = "None was drawn from these results: `tactbench run` makes what the paper's figures show."
        return Section("figures", "Figures", missing=subject.undrawn or (none,))
    pictures = tuple(picture(one, subject) for one in drawn)
    paragraphs = ("The same figures lie beside this page as `figures/*.pdf` and `figures/*.png`.",)
    return Section("figures", "Figures", paragraphs=paragraphs, pictures=pictures, missing=subject.undrawn)
