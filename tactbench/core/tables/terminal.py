"""Tables and notes on a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from tactbench.core.tables.fitting import cut, fit, wrapped
from tactbench.core.tables.text_table import TextTable

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red", "skipped": "dim", "alarm": "yellow", "inside": "bold"}
_GAPS = (3, 2)
"""Spaces between columns: the first where there is room."""
_MARGIN = 2
Part = TextTable | Sequence[str]
"""Of what is printed: a table, or notes."""
Styled = tuple[str, str]
"""A line, and how it looks."""


def show(parts: Iterable[Part], console: Console) -> None:
    """Print tables and notes; text from plugins is never read as markup."""
    from rich.segment import Segment, Segments

    segments = [
        part
        for text, style in _lines(parts, console.width)
        for part in (Segment(text, console.get_style(style) if style else None), Segment("\n"))
    ]
    console.print(Segments(segments), soft_wrap=True, end="")


def plain_text(parts: Iterable[Part], width: int = 240) -> str:
    """Return what a terminal without colours shows; the width is enough for names of ordinary length."""
    return "".join(f"{text}\n" for text, _ in _lines(parts, width))


def _lines(parts: Iterable[Part], width: int) -> Iterator[Styled]:
    left_out: dict[str, None] = {}
    last = ""
    for part in parts:
        if last:
            yield "", ""
        table = part if isinstance(part, TextTable) else None
        lines, hidden = _table_lines(table, width) if table else ([], [])
        lines += _note_lines(part.notes if isinstance(part, TextTable) else part, width)
        yield from lines
        left_out |= dict.fromkeys(hidden)
        last = lines[-1][0] if lines else last
    if left_out:
        yield from _note_lines(
            [f"This terminal is too narrow for: {', '.join(left_out)}. They are in the files."], width
        )


def _table_lines(table: TextTable, width: int) -> tuple[list[Styled], list[str]]:
    """Return the lines of a table with their styles, and the columns that there was no room for."""
    lines = [part for line in table.lines for part in _split(line)]
    places = {name: place for place, name in enumerate(table.columns)}
    breakable = {
        place
        for name, place in places.items()
        if (name in table.intervals or name not in table.numeric) and name not in table.unbroken
    }
    intervals = {places[name] for name in table.intervals if name in places}
    to_go = [places[name] for name in table.first_to_go if name in places]
    for gap in _GAPS:
        widths, hidden = fit(
            table.headers, lines, breakable, room=width - _MARGIN, gap=gap, measure=_width, first_to_go=to_go,
            broken_last=intervals, uncut={places[name] for name in table.unbroken if name in places},
        )  # fmt: skip
        natural = fit(table.headers, lines, (), room=float("inf"), gap=gap, measure=_width)[0]
        if widths == natural:
            break

    def padded(cells: Sequence[str]) -> Iterator[str]:
        parts = {
            place: [
                part
                for text in cells[place].split("\n")
                for whole in wrapped(text, room, _width)
                for part in cut(whole, room, _width)
            ]
            for place, room in widths.items()
        }
        for number in range(max(map(len, parts.values()), default=0)):
            texts = []
            for place, part in parts.items():
                text = part[number] if number < len(part) else ""
                blank = " " * int(widths[place] - _width(text))
                texts.append(blank + text if table.right[place] else text + blank)
            yield f"{' ' * _MARGIN}{(' ' * gap).join(texts)}".rstrip()

    rule = f" {'─' * int(sum(widths.values()) + gap * (len(widths) - 1) + 2)}"
    body: list[Styled] = [(text, "bold") for text in padded(table.headers)]
    body.append((rule[:width], ""))
    for line, kind in zip(table.lines, table.kinds or [""] * len(table.lines), strict=True):
        body += [(text, _STYLE.get(kind, "")) for text in padded(line)]
    title: list[Styled] = [(line, "bold") for line in _folded(table.title, width)]
    title += [(line, "") for text in table.summary for line in _folded(text, width)]
    return [*title, ("", ""), *body, ("", "")], [table.columns[place] for place in hidden]


def _split(line: Sequence[str]) -> list[list[str]]:
    """Return a line whose texts have several lines as several."""
    parts = [text.split("\n") for text in line]
    return [[part[at] if at < len(part) else "" for part in parts] for at in range(max(map(len, parts), default=1))]


def _folded(text: str, width: int) -> list[str]:
    """Return `text` in lines that fit, broken between words; what is twice as wide as a letter is left to rich."""
    taken = _width(text)
    if taken <= width:
        return [text]
    if taken == len(text):
        return textwrap.wrap(text, width, break_on_hyphens=False)
    from rich.console import Console
    from rich.text import Text

    return [line.plain for line in Text(text).wrap(Console(width=width), width)]


def _width(text: str) -> int:
    """Return how many places of a terminal `text` takes."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len

    return cell_len(text)


def _note_lines(notes: Sequence[str], width: int) -> list[Styled]:
    return [(f" {line}", "dim") for note in notes for line in _folded(note, width - 1)]
