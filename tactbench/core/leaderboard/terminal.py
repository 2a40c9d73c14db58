"""The table on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from tactbench.core.leaderboard.columns import NUMERIC
from tactbench.core.leaderboard.sections import Section
from tactbench.core.leaderboard.table import ABSENT, Block, Table

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red", "skipped": "dim"}
_FIRST_TO_GO = (
    "batch/row", "p95", "sessions", "n test", "sim", "baseline", "fit", "published", "latency p50", "rank 95 %",
)  # fmt: skip
"""Columns that a narrow terminal does without, in this order; the files have them all."""
_AROUND_A_CELL = 3
_WITHOUT_EDGE = 240
"""Wide enough for every column of names of ordinary length."""


def show(table: Table, console: Console) -> None:
    """Print a leaderboard on `console`; text from plugins is never read as markup."""
    from rich.segment import Segment, Segments

    left_out: set[str] = set()
    said: list[Segment] = []
    width = console.width
    style = {name: console.get_style(name) for name in ("bold", *_STYLE.values())}
    for block in table.blocks:
        lines, gone = _block_lines(table.columns, block, width)
        left_out |= gone
        for text, how in lines:
            said += (Segment(text, style.get(how)), Segment("\n"))
    console.print(Segments(said), soft_wrap=True, end="")
    notes = list(table.notes)
    if left_out:
        names = ", ".join(name for name in table.columns if name in left_out)
        notes.append(f"This terminal is too narrow for: {names}. They are in the files.")
    _show_notes(notes, console)
    for section in table.sections:
        _show_section(section, console)
    if table.foot:
        console.print()
        _show_notes(table.foot, console)


def _block_lines(columns: Sequence[str], block: Block, width: int) -> tuple[list[tuple[str, str]], set[str]]:
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


def _folded(title: str, width: int) -> list[str]:
    """Return `title` in lines that fit."""
    if _width(title) <= width:
        return [title]
    from rich.console import Console
    from rich.text import Text

    return [line.plain for line in Text(title).wrap(Console(width=width), width)]


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
    _show_notes(section.notes, console)


def _show_notes(notes: Sequence[str], console: Console) -> None:
    from rich.padding import Padding
    from rich.text import Text

    for note in notes:
        console.print(Padding(Text(note, style="dim"), (0, 0, 0, 1), expand=False))


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


def plain_text(table: Table) -> str:
    """Return what a terminal without edge and colours shows."""
    import io

    from rich.console import Console

    out = io.StringIO()
    show(table, Console(file=out, width=_WITHOUT_EDGE, highlight=False, color_system=None))
    return out.getvalue()
