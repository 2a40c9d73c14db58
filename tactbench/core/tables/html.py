"""Tables and notes as HTML, for a notebook's output."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from tactbench.core.tables.text_table import TextTable


def html(parts: Iterable[TextTable | Sequence[str]]) -> str:
    """Return tables and notes as HTML without scripts or styles of their own; text from plugins is escaped."""
    return "\n".join(_table(part) if isinstance(part, TextTable) else _sentences(part) for part in parts)


def _table(table: TextTable) -> str:
    def line(texts: Sequence[str], tag: str, style: str = "") -> str:
        sides = ("right" if right else "left" for right in table.right)
        cells = (
            f'<{tag} style="text-align: {side}">{escape(text)}</{tag}>' for text, side in zip(texts, sides, strict=True)
        )
        return f"<tr{style}>{''.join(cells)}</tr>"

    kinds = table.kinds or [""] * len(table.lines)
    dim = (' style="opacity: 0.6"' if kind in ("baseline", "skipped") else "" for kind in kinds)
    body = "".join(line(texts, "td", style) for texts, style in zip(table.lines, dim, strict=True))
    return (
        f"<p><b>{escape(table.title)}</b> <small>{escape(table.origin)}</small></p>{_sentences(table.summary)}"
        f"<table><thead>{line(table.headers, 'th')}</thead><tbody>{body}</tbody></table>{_sentences(table.notes)}"
    )


def _sentences(texts: Sequence[str]) -> str:
    return f"<p>{'<br>'.join(map(escape, texts))}</p>" if texts else ""
