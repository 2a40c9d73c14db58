"""Output on a terminal: tables and notes on stdout, remarks on stderr."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal

from tactbench.core.tables.text import TextTable, visible_lines

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red", "skipped": "dim", "alarm": "yellow", "inside": "bold"}
_GAP, _MARGIN = 2, 1
_LEAST = 4
"""Smallest width of a column of words [characters]."""
WITHOUT_EDGE = 400
"""Width of a table in a file or a pipe [characters], enough for all columns with names of ordinary length."""
Part = TextTable | Sequence[str]
"""Part of an output: a table, or a sequence of notes."""


def remark(text: str) -> None:
    """Print a remark on stderr, since stdout is for results; control characters are escaped."""
    print(visible_lines(text), file=sys.stderr)


def show(parts: Iterable[Part]) -> None:
    """Print tables and notes on stdout; markup in their texts is printed literally."""
    from rich.console import Console

    if sys.stdout.isatty():
        _print(parts, Console(highlight=False))
    else:
        sys.stdout.write(plain_text(parts))


def plain_text(parts: Iterable[Part], width: int = WITHOUT_EDGE) -> str:
    """Return tables and notes as on a terminal of `width` characters without colours."""
    from rich.console import Console

    out = io.StringIO()
    # In a notebook it would display the text beside, and write none.
    console = Console(file=out, width=width, color_system=None, force_jupyter=False)
    _print(parts, console)
    return "".join(f"{line.rstrip()}\n" for line in out.getvalue().split("\n")[:-1])


def _print(parts: Iterable[Part], console: Console) -> None:
    left_out: dict[str, None] = {}
    for place, part in enumerate(parts):
        if place:
            console.print()
        if isinstance(part, TextTable):
            left_out |= dict.fromkeys(_print_table(part, console))
        _print_notes(part.notes if isinstance(part, TextTable) else part, console)
    if left_out:
        _print_notes([f"Too narrow for: {', '.join(left_out)}."], console)


def _print_notes(notes: Sequence[str], console: Console) -> None:
    from rich.padding import Padding
    from rich.text import Text

    for note in notes:
        console.print(Padding(Text(note, "dim"), (0, 0, 0, _MARGIN)))


def _print_table(table: TextTable, console: Console) -> list[str]:
    """Print a table without its notes; return the headings of the columns that did not fit."""
    from rich.cells import cell_len
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    widths = _widths(table, console.width - _MARGIN)
    taken = sum(widths.values()) + _GAP * (len(widths) - 1) + _MARGIN
    blank = taken - cell_len(table.title) - cell_len(table.origin)
    origin = (" " * blank if blank > 1 else "\n") + table.origin if table.origin else ""
    sentences = "".join(f"\n{one}" for one in (*table.summary, ""))
    console.print(Text.assemble((table.title + origin, "bold"), sentences))
    grid = Table(box=None, pad_edge=False, padding=(0, _GAP, 0, 0), header_style="bold")
    for place, width in widths.items():
        justify: Literal["left", "right"] = "right" if table.right[place] else "left"
        grid.add_column(Text(table.headers[place]), justify=justify, width=width, overflow="fold")
    for line, kind in zip(table.lines, table.kinds or [""] * len(table.lines), strict=True):
        grid.add_row(*(Text(line[place]) for place in widths), style=_STYLE.get(kind, ""))
    console.print(Padding(grid, (0, 0, 0, _MARGIN)))
    if table.notes:
        console.print()
    return [head for place, head in enumerate(table.headers) if place not in widths]


def _widths(table: TextTable, room: int) -> dict[int, int]:
    """Return the widths of the columns that fit into `room` characters, by index of the column.

    Headings and texts are broken at spaces, numbers are not. Columns in `first_to_go` go before a word is cut.
    """
    from rich.cells import cell_len

    widths, least, body = {}, {}, {}
    for place, (name, head, *texts) in enumerate(zip(table.columns, table.headers, *table.lines, strict=True)):
        lines = [line for text in texts for line in text.split("\n")]
        body[place] = max(map(cell_len, lines), default=0)
        kept = lines if name in table.numeric | table.unbroken else " ".join(lines).split()
        least[place] = max(map(cell_len, [*head.split(), *kept, " "]))
        widths[place] = max(1, cell_len(head), body[place])

    def excess(of: dict[int, int]) -> int:
        return sum(of[place] + _GAP for place in widths) - _GAP - room

    for name in table.first_to_go:
        if excess(least) > 0 and name in table.columns:
            del widths[table.columns.index(name)]
    words = {place: least[place] if name in table.numeric | table.unbroken else _LEAST
             for place, name in enumerate(table.columns)}  # fmt: skip
    for bound in (least, words):
        while excess(widths) > 0 and (slack := [place for place in widths if widths[place] > bound[place]]):
            # Headings first: breaking one costs a single line.
            widths[max(slack, key=lambda place: (widths[place] > body[place], widths[place]))] -= 1
    return widths
