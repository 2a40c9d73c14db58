"""Output of tables as HTML, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from tactbench.core.tables.text_table import TextTable


def html(tables: Iterable[TextTable]) -> str:
    """Return tables and their notes as HTML without scripts; all texts are escaped."""
    return "\n".join(map(_table, tables))


def _table(table: TextTable) -> str:
    def line(texts: Sequence[str], tag: str, kind: str = "") -> str:
        sides = ("right" if right else "left" for right in table.right)
        cells = zip(texts, sides, strict=True)
        found = "".join(f'<{tag} style="text-align: {side}">{escape(text)}</{tag}>' for text, side in cells)
        return f'<tr style="opacity: {0.6 if kind == "baseline" else 1}">{found}</tr>'

    kinds = table.kinds or [""] * len(table.lines)
    body = "".join(line(texts, "td", kind) for texts, kind in zip(table.lines, kinds, strict=True))
    grid = f"<table><thead>{line(table.headers, 'th')}</thead><tbody>{body}</tbody></table>"
    above = _sentences((f"{table.title} {table.origin}".strip(), *table.summary))
    return above + grid + _sentences(table.notes)


def _sentences(texts: Sequence[str]) -> str:
    return f"<p>{'<br>'.join(map(escape, texts))}</p>" if texts else ""
