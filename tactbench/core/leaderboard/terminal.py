"""The table on a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.columns import INTERVALS
from tactbench.core.leaderboard.fitting import fit, wrapped
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.text_table import TextTable
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red", "skipped": "dim", "alarm": "yellow", "plain": ""}
_FIRST_TO_GO = (
    "cell", "batch/row", "p95", "sessions", "n test", "sim", "baseline", "latency p50", "rank 95 %", "fit",
    "true error", "95 % interval", "published", "delay", "95 % beyond",
)  # fmt: skip
"""Columns that a terminal does without, in this order, where it is too narrow for them even with broken texts; those
that were asked for by name are never left out."""
_GAPS = (3, 2)
"""Spaces between columns: the first where there is room."""
_MARGIN = 2
Styled = tuple[str, str]
"""A line, and how it looks."""


def show(table: Table, console: Console, view: View = DEFAULT_VIEW) -> None:
    """Print a leaderboard on `console`; text from plugins is never read as markup."""
    from rich.segment import Segment, Segments

    style = {name: console.get_style(name) for name in {"bold", *filter(None, _STYLE.values())}}
    said = [
        part
        for text, how in _lines(table, console.width, view)
        for part in (Segment(text, style.get(how)), Segment("\n"))
    ]
    console.print(Segments(said), soft_wrap=True, end="")


def blocks_text(table: Table, width: int) -> str:
    """Return the blocks of a table alone, without notes, as a terminal without colours shows them."""
    grids = viewed.grids(table, DEFAULT_VIEW)
    return "\n".join(text for grid in grids for text, _ in _grid_lines(grid, width, _FIRST_TO_GO)[0])


def plain_text(table: Table, width: int = 240, view: View = DEFAULT_VIEW) -> str:
    """Return what a terminal without colours shows; the width is enough for names of ordinary length."""
    return "".join(f"{text}\n" for text, _ in _lines(table, width, view))


def _lines(table: Table, width: int, view: View) -> Iterator[Styled]:
    left_out: dict[str, None] = {}
    for grid in viewed.grids(table, view):
        lines, gone = _grid_lines(grid, width, () if view.columns else _FIRST_TO_GO)
        left_out |= dict.fromkeys(gone)
        yield from lines
    notes = [*viewed.notes(table, view), *viewed.commands(table, view)]
    notes += _too_narrow(left_out)
    yield from _note_lines(notes, width)
    for section in viewed.sections(table, view):
        yield "", ""
        yield from _section_lines(section, width)
    footer = viewed.footer(table, view)
    if footer:
        yield "", ""
        yield from _note_lines(footer, width)


def _too_narrow(names: Collection[str]) -> list[str]:
    return [f"This terminal is too narrow for: {', '.join(names)}. They are in the files."] if names else []


def _section_lines(section: TextTable, width: int) -> Iterator[Styled]:
    lines, gone = _grid_lines(section, width, section.columns[:0:-1])
    yield from lines
    yield from _note_lines([*section.notes, *_too_narrow(gone)], width)


def _grid_lines(grid: TextTable, width: int, first_to_go: Sequence[str]) -> tuple[list[Styled], list[str]]:
    """Return the lines of a table with their styles, and the columns, of `first_to_go`, that there was no room for.

    Lines are padded here: a grid of rich takes a second for a thousand of them, and a text of its own for each of a
    thousand blocks a third of one.
    """
    numeric = grid.numeric
    places = {name: place for place, name in enumerate(grid.columns)}
    breakable = {
        place for name, place in places.items() if (name in INTERVALS or name not in numeric) and name != viewed.CELL
    }
    intervals = {places[name] for name in INTERVALS if name in places}
    to_go = [places[name] for name in first_to_go if name in places]
    for gap in _GAPS:
        widths, gone = fit(
            grid.headers, grid.lines, breakable, room=width - _MARGIN, gap=gap, measure=_width, first_to_go=to_go,
            broken_last=intervals,
        )  # fmt: skip
        natural = fit(grid.headers, grid.lines, (), room=float("inf"), gap=gap, measure=_width)[0]
        if widths == natural:
            break
    right = {place for name, place in places.items() if name in numeric}

    def padded(cells: Sequence[str]) -> Iterator[str]:
        parts = {place: wrapped(cells[place], room, _width) for place, room in widths.items()}
        for number in range(max(map(len, parts.values()))):
            texts = {place: part[number] if number < len(part) else "" for place, part in parts.items()}
            yield _padded(texts, right, widths, gap)

    rule = f" {'─' * int(sum(widths.values()) + gap * (len(widths) - 1) + 2)}"
    body: list[Styled] = [(text, "bold") for text in padded(grid.headers)]
    body.append((rule[:width], ""))
    for place, line in enumerate(grid.lines):
        style = _STYLE[grid.kinds[place] if grid.kinds else "plain"]
        body += [(text, style) for text in padded(line)]
    title: list[Styled] = [(line, "bold") for line in _folded(grid.title, width)]
    title += [(line, "") for text in grid.summary for line in _folded(text, width)]
    return [*title, ("", ""), *body, ("", "")], [grid.columns[place] for place in gone]


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


def _padded(cells: Mapping[int, str], right: Iterable[int], widths: Mapping[int, float], gap: int) -> str:
    """Return one line, columns of numbers to the right."""
    parts = []
    for place, width in widths.items():
        blank = " " * int(width - _width(cells[place]))
        parts.append(blank + cells[place] if place in right else cells[place] + blank)
    return f"{' ' * _MARGIN}{(' ' * gap).join(parts)}".rstrip()


def _note_lines(notes: Sequence[str], width: int) -> Iterator[Styled]:
    for note in notes:
        for line in _folded(note, width - 1):
            yield f" {line}", "dim"
