"""The table as Markdown; names stay text, whatever they are made of."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View

_ACTS = re.compile(r"[\\|*\[\]~]|(?<![^\W_])_|_(?![^\W_])")
"""Begins something wherever it stands; an underscore does so only at the edge of a word."""
_BEGINS_A_LINE = re.compile(r"[#>+=-]|[0-9]+[.)]")


def markdown(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return the table as Markdown, a heading a block."""
    parts: list[str] = []
    for grid in viewed.grids(table, view):
        numeric = {head for name, head in zip(grid.columns, grid.headers, strict=True) if name in grid.numeric}
        heading, *lines = markdown_grid(grid.title, grid.headers, numeric, grid.lines)
        parts += [heading, *(f"{markdown_note(text)}\n" for text in grid.said), *lines, ""]
    parts += [f"- {markdown_note(note)}" for note in (*viewed.notes(table, view), *viewed.commands(table, view))]
    for section in viewed.sections(table, view):
        parts += ["", *markdown_grid(section.title, section.columns, section.numeric, section.lines)]
        parts += ["", *(f"- {markdown_note(note)}" for note in section.notes)] if section.notes else []
    foot = viewed.foot(table, view)
    parts += ["", *(f"- {markdown_note(sentence)}" for sentence in foot)] if foot else []
    return "\n".join(parts) + "\n"


def markdown_grid(
    title: str, columns: Sequence[str], numeric: Collection[str], lines: Iterable[Iterable[str]]
) -> list[str]:
    """Return a heading and a table as lines of Markdown, columns of numbers to the right."""
    return [
        f"### {_heading(title)}\n",
        "| " + " | ".join(markdown_text(name) for name in columns) + " |",
        "|" + "|".join("---:" if name in numeric else "---" for name in columns) + "|",
        *("| " + " | ".join(markdown_text(cell) for cell in line) + " |" for line in lines),
    ]


def _heading(title: str) -> str:
    told = markdown_text(title).rstrip()
    return f"{told[:-1]}\\#" if told.endswith("#") else told


def markdown_text(text: str) -> str:
    """Return text that Markdown shows as it is, in a table or a heading; on one line."""
    return _escaped(text).replace("`", "\\`")


def markdown_note(text: str) -> str:
    """Return a sentence that Markdown shows as it is, but for words between backticks, which are code."""
    escaped = _escaped(text.strip())
    begins = _BEGINS_A_LINE.match(escaped)
    return f"{escaped[: begins.end() - 1]}\\{escaped[begins.end() - 1 :]}" if begins else escaped


def _escaped(text: str) -> str:
    told = _ACTS.sub(r"\\\g<0>", text.replace("\n", " "))
    return told.replace("&", "&amp;").replace("<", "&lt;")
