"""Output of tables as Markdown; markup in texts is escaped."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from tactbench.core.tables.text_table import TextTable

_ACTS = re.compile(r"[\\|*\[\]~]|(?<![^\W_])_|_(?![^\W_])")
"""Characters to escape: those that are markup anywhere, and underscores at the edge of a word."""


def markdown(parts: Iterable[TextTable | Sequence[str]]) -> str:
    """Return tables, each under its title as a heading, and lists of notes as Markdown."""
    return "\n\n".join("\n".join(_table(one) if isinstance(one, TextTable) else _notes(one)) for one in parts) + "\n"


def _table(table: TextTable) -> list[str]:
    """Return a table as lines of Markdown: heading, sentences, columns with numbers aligned right, notes."""
    return [
        f"### {markdown_text(table.title)}\n",
        *([f"{markdown_note(table.origin)}\n"] if table.origin else []),
        *(f"{markdown_note(text)}\n" for text in table.summary),
        "| " + " | ".join(markdown_text(name) for name in table.headers) + " |",
        "|" + "|".join("---:" if right else "---" for right in table.right) + "|",
        *("| " + " | ".join(map(markdown_text, line)) + " |" for line in table.lines),
        *(["", *_notes(table.notes)] if table.notes else []),
    ]


def _notes(notes: Sequence[str]) -> list[str]:
    return [f"- {markdown_note(note)}" for note in notes]


def markdown_text(text: str) -> str:
    """Return text escaped for a Markdown table or heading; line breaks become ``<br>``."""
    return "<br>".join(_escaped(line).replace("`", "\\`") for line in text.split("\n"))


def markdown_note(text: str) -> str:
    """Return a sentence escaped for Markdown; words between backticks stay code."""
    return _escaped(text.strip())


def _escaped(text: str) -> str:
    escaped = _ACTS.sub(r"\\\g<0>", text.replace("\n", " "))
    return escaped.replace("&", "&amp;").replace("<", "&lt;")
