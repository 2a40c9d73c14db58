"""The table on a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from tactbench.core.leaderboard.columns import NUMERIC
from tactbench.core.leaderboard.sections import Section
from tactbench.core.leaderboard.table import ABSENT, Block, Table

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red", "skipped": "dim"}
_FIRST_TO_GO = (
    "batch/row", "p95", "sessions", "n test", "sim", "baseline", "latency p50", "fit", "published", "rank 95 %",
    "95 % beyond", "delay",
)  # fmt: skip
"""Columns that a narrow terminal does without, in this order; the files have them all."""
_AROUND_A_CELL = 3
Styled = tuple[str, str]
"""A line, and how it looks."""


def show(table: Table, console: Console) -> None:
    """Print a leaderboard on `console`; text from plugins is never read as markup."""
    from rich.segment import Segment, Segments

    style = {name: console.get_style(name) for name in {"bold", *_STYLE.values()}}

    def say(lines: Iterable[Styled]) -> None:
        said = [part for text, how in lines for part in (Segment(text, style.get(how)), Segment("\n"))]
        console.print(Segments(said), soft_wrap=True, end="")

    say(_above(table, console.width))
    for section in table.sections:
        _show_section(section, console)
    say(_below(table, console.width))


def plain_text(table: Table, width: int = 240) -> str:
    """Return what a terminal without colours shows; the width is enough for names of ordinary length."""
    lines = [text for text, _ in _above(table, width)]
    if table.sections:
        import io

        from rich.console import Console

        out = io.StringIO()
        for section in table.sections:
            _show_section(section, Console(file=out, width=width, highlight=False, color_system=None))
        lines += out.getvalue().split("\n")[:-1]
    lines += [text for text, _ in _below(table, width)]
    return "".join(f"{line}\n" for line in lines)


def _above(table: Table, width: int) -> Iterator[Styled]:
    """Yield the lines above the sections."""
    left_out: set[str] = set()
    for block in table.blocks:
        lines, gone = _block_lines(table.columns, block, width)
        left_out |= gone
        yield from lines
    notes = list(table.notes)
    if left_out:
        names = ", ".join(name for name in table.columns if name in left_out)
        notes.append(f"This terminal is too narrow for: {names}. They are in the files.")
    yield from _note_lines(notes, width)


def _below(table: Table, width: int) -> Iterator[Styled]:
    """Yield the lines below the sections."""
    if table.foot:
        yield "", ""
        yield from _note_lines(table.foot, width)


def _block_lines(columns: Sequence[str], block: Block, width: int) -> tuple[list[Styled], set[str]]:
    """Return the lines of a block with their styles, and the columns that there was no room for.

    Lines are padded and cut here: a grid of rich takes a second for a thousand of them, and a text of its own for each
    of a thousand blocks a third of one.
    """
    widths, gone = _fitting(columns, block, width)
    rule = f" {'─' * (sum(widths.values()) + _AROUND_A_CELL * len(widths) - 1)}"
    body = [(_padded(columns, columns, widths), "bold"), (rule[:width], "")]
    body += [(_padded(line.cells, columns, widths), _STYLE[line.kind]) for line in block.lines]
    title = [(line, "bold") for line in _folded(block.title, width)]
    return [*title, ("", ""), *((_cut(text, width), how) for text, how in body), ("", "")], gone


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


def _cut(line: str, width: int) -> str:
    """Return `line`, or as much of it as fits."""
    if _width(line) <= width:
        return line
    from rich.cells import set_cell_size

    return f"{set_cell_size(line, width - 1)}…"


def _padded(cells: Sequence[str], columns: Sequence[str], widths: Mapping[int, int]) -> str:
    """Return one line of a block, columns of numbers to the right."""
    parts = []
    for place, width in widths.items():
        blank = " " * (width - _width(cells[place]))
        parts.append(blank + cells[place] if columns[place] in NUMERIC else cells[place] + blank)
    return f"  {(' ' * _AROUND_A_CELL).join(parts)}".rstrip()


def _show_section(section: Section, console: Console) -> None:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    console.print(Text(f"\n{section.title}", style="bold"))
    grid = RichTable(box=box.SIMPLE_HEAD)
    for name in section.columns:
        grid.add_column(Text(name), justify="right" if name in section.numeric else "left", overflow="fold")
    for place, line in enumerate(section.lines):
        grid.add_row(*map(Text, line), style="yellow" if place in section.alarms else "")
    console.print(grid)
    for text, how in _note_lines(section.notes, console.width):
        console.print(Text(text, style=how), soft_wrap=True)


def _note_lines(notes: Sequence[str], width: int) -> Iterator[Styled]:
    for note in notes:
        for line in _folded(note, width - 1):
            yield f" {line}", "dim"


def _fitting(columns: Sequence[str], block: Block, width: int) -> tuple[dict[int, int], set[str]]:
    """Return the places of the columns to show with their widths, and the names of those that there is no room for.

    Empty columns are never shown.
    """
    widths = {
        place: max(_width(columns[place]), *(_width(line.cells[place]) for line in block.lines))
        for place in range(len(columns))
        if any(line.cells[place].strip(ABSENT) for line in block.lines)
    }
    gone: set[str] = set()
    for name in _FIRST_TO_GO:
        if sum(widths.values()) + _AROUND_A_CELL * len(widths) <= width:
            break
        place = columns.index(name) if name in columns else -1
        if widths.pop(place, None) is not None:
            gone.add(name)
    return widths, gone
