"""The tables as plain HTML, for a reader without scripts, and for a search or a printer that knows none."""

from __future__ import annotations

from html import escape

from tactbench.core.leaderboard.columns import NUMERIC
from tactbench.core.leaderboard.one_file import prose
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.text import visible


def static_tables(table: Table) -> str:
    """Return every block of `table` as HTML, and its notes; everything in them is escaped."""
    parts: list[str] = []
    for block in table.blocks:
        heads = "".join(
            f'<th scope="col"{_class(name)}>{_text(name)}</th>' for name in (*table.columns, "status and reason")
        )
        lines = []
        for line in block.lines:
            why = "" if line.row["status"] == "done" else visible(f"{line.row['status']}: {line.row['reason']}")
            cells = "".join(
                f"<td{_class(name)}>{_text(text)}</td>" for name, text in zip(table.columns, line.cells, strict=True)
            )
            lines.append(f'<tr class="{line.kind}">{cells}<td>{_text(why)}</td></tr>')
        body = "\n".join(lines)
        said = "".join(f"<p>{_text(one)}</p>" for one in block.verdict)
        parts.append(
            f'<div class="box"><table><caption>{_text(block.title)}{said}</caption>\n'
            f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>"
        )
    notes = "\n".join(f"<li>{prose(note)}</li>" for note in (*table.notes, *table.footer))
    return "\n".join(parts) + f'\n<ul class="notes">\n{notes}\n</ul>'


def _class(name: str) -> str:
    return ' class="number"' if name in NUMERIC else ""


def _text(text: str) -> str:
    return f"<bdi>{escape(text)}</bdi>"
