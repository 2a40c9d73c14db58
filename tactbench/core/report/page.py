"""The page: sections in order, laid into one HTML text that needs nothing from anywhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tactbench.core.leaderboard.view import full_grid
from tactbench.core.report.cells import cells_section
from tactbench.core.report.compared import compared_section
from tactbench.core.report.costs import costs_section
from tactbench.core.report.figures.published_and_ours import COLUMN
from tactbench.core.report.figures.published_and_ours import NAME as PUBLISHED
from tactbench.core.report.findings import findings_section
from tactbench.core.report.opening import about_section, answers_section
from tactbench.core.report.published import published_section
from tactbench.core.report.results import SavedFigure
from tactbench.core.report.section import Maker, Picture, ReportData, Section, block_anchor
from tactbench.core.report.sensors import sensors_section
from tactbench.core.tables.html import render


def leaderboards_section(subject: ReportData) -> Section:
    """Return the section of leaderboards, failed and skipped cells with their reasons."""
    table = subject.leaderboard
    tables = tuple(
        replace(subject.linked(full_grid(block)), anchor=block_anchor(place))
        for place, block in enumerate(table.blocks)
    )
    paragraphs = ("Click a heading to sort by it; click it again to turn the order round.",)
    return Section("leaderboards", "Leaderboards", paragraphs=paragraphs, tables=tables, notes=table.notes)


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


TITLE = "tactbench: tactile sensors, what they answer and what it costs"

# Anchor, title and maker of each section: a section that cannot be made says so under its own title.
SECTIONS: tuple[tuple[str, str, Maker], ...] = (
    ("answers", "What came out", answers_section),
    ("reproduction", "Published numbers, and ours", published_section),
    ("leaderboards", "Leaderboards", leaderboards_section),
    ("figures", "Figures", pictures_section),
    ("findings", "The paper's findings", findings_section),
    ("sensors", "Sensors", sensors_section),
    ("compared", "The same questions asked otherwise", compared_section),
    ("cost", "What accuracy costs in time", costs_section),
    ("cells", "Every cell", cells_section),
    ("about", "What this was made of", about_section),
)


@dataclass(frozen=True)
class Page:
    """The text, and what it lacks."""

    html: str
    missing: tuple[str, ...]
    """What sections lack, one sentence each, with the command that makes it."""
    broken: tuple[str, ...]
    """One sentence a section that could not be made although its results are there."""


def make_page(subject: ReportData) -> Page:
    """Return the page: the same results give the same bytes.

    A section that cannot be made takes no other with it: it says why.
    """
    sections: list[Section] = []
    broken: list[str] = []
    for anchor, title, make in SECTIONS:
        try:
            sections.append(make(subject))
        except Exception as error:
            reason = f"This section cannot be made from these results: {type(error).__name__}: {error}"
            broken.append(f"{title}: {reason}")
            sections.append(Section(anchor, title, missing=(reason,)))
    missing = [f"{section.title}: {lacked}" for section in sections for lacked in section.missing]
    html = render(
        "tactbench.core.report", "page.html", title=TITLE, styles=["page.css"], scripts=["page.js"], sections=sections
    )
    return Page(f"{html}\n", tuple(one for one in missing if one not in broken), tuple(broken))
