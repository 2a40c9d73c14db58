"""Duels in the formats of papers and pages."""

from __future__ import annotations

from collections.abc import Sequence

from tactbench.core.leaderboard.duel_table import NUMERIC, DuelTable
from tactbench.core.leaderboard.latex import latex_grid
from tactbench.core.leaderboard.markdown import markdown_grid, markdown_note


def markdown(tables: Sequence[DuelTable], notes: Sequence[str]) -> str:
    """Return the tables as Markdown, the notes below."""
    parts: list[str] = []
    for table in tables:
        parts += [*markdown_grid(table.title, table.columns, NUMERIC, table.lines), ""]
    return "\n".join([*parts, *(f"- {markdown_note(note)}" for note in notes)]) + "\n"


def latex(tables: Sequence[DuelTable], notes: Sequence[str]) -> str:
    """Return the tables as LaTeX for the booktabs package, the notes below the last."""
    parts: list[str] = []
    for number, table in enumerate(tables):
        below = notes if table is tables[-1] else ()
        parts += latex_grid(table.title, table.columns, NUMERIC, table.lines, below, number=number, star=True)
    return "\n".join(parts) + "\n"
