"""The leaderboards: every block of the table as a table that can be sorted."""

from __future__ import annotations

from dataclasses import replace

from tactbench.core.leaderboard.view import full_grid
from tactbench.core.report.section import ReportData, Section


def leaderboards_section(subject: ReportData) -> Section:
    """Return the section of leaderboards, failed and skipped cells with their reasons."""
    table = subject.leaderboard
    tables = tuple(
        replace(full_grid(block, subject.anchors), anchor=block_anchor(place))
        for place, block in enumerate(table.blocks)
    )
    paragraphs = ("Click a heading to sort by it; click it again to turn the order round.",)
    return Section("leaderboards", "Leaderboards", paragraphs=paragraphs, tables=tables, notes=table.notes)


def block_anchor(place: int) -> str:
    """Return where the page shows the block at this place of the table."""
    return f"leaderboard-{place + 1}"
