"""The table as Markdown; names stay text, whatever they are made of."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.text_table import TextTable
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View

_ACTS = re.compile(r"[\\|*\[\]~]|(?<![^\W_])_|_(?![^\W_])")
"""Begins something wherever it stands; an underscore does so only at the edge of a word."""
_BEGINS_A_LINE = re.compile(r"[#>+=-]|[0-9]+[.)]")


def markdown(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return the table as Markdown, a heading a block."""
    parts: list[str] = []
    for grid in viewed.grids(table, view):
        parts += [*markdown_lines(grid), ""]
    parts += [f"- {markdown_note(note)}" for note in (*viewed.notes(table, view), *viewed.commands(table, view))]
    for section in viewed.sections(table, view):
        parts += ["", *markdown_lines(section)]
    footer = viewed.footer(table, view)
    parts += ["", *(f"- {markdown_note(sentence)}" for sentence in footer)] if footer else []
    return "\n".join(parts) + "\n"


def markdown_lines(table: TextTable) -> list[str]:
    """Return a table as lines of Markdown: a heading, sentences, columns of numbers to the right, notes."""
    return [
        f"### {_heading(table.title)}\n",
        *(f"{markdown_note(text)}\n" for text in table.summary),
        "| " + " | ".join(markdown_text(name) for name in table.headers) + " |",
        "|" + "|".join("---:" if right else "---" for right in table.right) + "|",
        *("| " + " | ".join(markdown_text(cell) for cell in line) + " |" for line in table.lines),
        *(["", *(f"- {markdown_note(note)}" for note in table.notes)] if table.notes else []),
    ]


def markdown_grid(
    title: str, columns: Sequence[str], numeric: Collection[str], lines: Iterable[Sequence[str]]
) -> list[str]:
    """Return a heading and a table as lines of Markdown, columns of numbers to the right."""
    return markdown_lines(TextTable(title, tuple(columns), tuple(map(tuple, lines)), frozenset(numeric)))


def _heading(title: str) -> str:
    text = markdown_text(title).rstrip()
    return f"{text[:-1]}\\#" if text.endswith("#") else text


def markdown_text(text: str) -> str:
    """Return text that Markdown shows as it is, in a table or a heading; on one line."""
    return _escaped(text).replace("`", "\\`")


def markdown_note(text: str) -> str:
    """Return a sentence that Markdown shows as it is, but for words between backticks, which are code."""
    escaped = _escaped(text.strip())
    begins = _BEGINS_A_LINE.match(escaped)
    return f"{escaped[: begins.end() - 1]}\\{escaped[begins.end() - 1 :]}" if begins else escaped


def _escaped(text: str) -> str:
    escaped = _ACTS.sub(r"\\\g<0>", text.replace("\n", " "))
    return escaped.replace("&", "&amp;").replace("<", "&lt;")


def markdown_tables(tables: Sequence[TextTable], notes: Sequence[str]) -> str:
    """Return tables as Markdown, notes below the last."""
    parts = [line for table in tables for line in (*markdown_lines(table), "")]
    return "\n".join([*parts, *(f"- {markdown_note(note)}" for note in notes)]) + "\n"
