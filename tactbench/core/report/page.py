"""The page: sections in order, laid into one HTML text that needs nothing from anywhere."""

from __future__ import annotations

from dataclasses import dataclass

from tactbench.core.report.cells import cells_section
from tactbench.core.report.compared import compared_section
from tactbench.core.report.costs import costs_section
from tactbench.core.report.findings import findings_section
from tactbench.core.report.leaderboards import leaderboards_section
from tactbench.core.report.opening import about_section, answers_section
from tactbench.core.report.pictures import pictures_section
from tactbench.core.report.published import published_section
from tactbench.core.report.section import Maker, ReportData, Section
from tactbench.core.report.sensors import sensors_section
from tactbench.core.tables.html import render

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
