"""The table on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tactbench.core.leaderboard import probe
from tactbench.core.leaderboard.table import NUMERIC, Block, build_table

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red"}
_FIRST_TO_GO = ("batch/row", "p95", "sessions", "n test", "sim", "baseline", "fit", "published", "latency p50")
"""Columns that a narrow terminal does without, in this order; the files have them all."""
_AROUND_A_CELL = 3


def show(rows: Sequence[Mapping[str, Any]], console: Console) -> None:
    """Print the leaderboard of `rows` on `console`; text from plugins is never read as markup."""
    from rich import box
    from rich.padding import Padding
    from rich.table import Table as RichTable
    from rich.text import Text

    table = build_table(rows)
    left_out: set[str] = set()
    for block in table.blocks:
        console.print(Text(block.title, style="bold"))  # not the grid's own title: that is folded to the grid's width
        grid = RichTable(box=box.SIMPLE_HEAD)
        places, gone = _fitting(table.columns, block, console.width)
        left_out |= gone
        for place in places:
            name = table.columns[place]
            grid.add_column(Text(name), justify="right" if name in NUMERIC else "left", no_wrap=True)
        for line in block.lines:
            grid.add_row(*(Text(line.cells[place]) for place in places), style=_STYLE[line.kind])
        console.print(grid)
    notes = list(table.notes)
    if left_out:
        names = ", ".join(name for name in table.columns if name in left_out)
        notes.append(f"This terminal is too narrow for: {names}. They are in the files.")
    for note in notes:
        console.print(Padding(Text(note, style="dim"), (0, 0, 0, 1), expand=False))
    _show_probe(rows, console)


def _show_probe(rows: Sequence[Mapping[str, Any]], console: Console) -> None:
    """Print what the recordings give away, if it was asked."""
    from rich import box
    from rich.padding import Padding
    from rich.table import Table as RichTable
    from rich.text import Text

    table = probe.build_probe(rows)
    if table is None:
        return
    console.print(Text(f"\n{table.title}", style="bold"))
    grid = RichTable(box=box.SIMPLE_HEAD)
    for name in table.columns:
        grid.add_column(Text(name), justify="right" if name in probe.NUMERIC else "left", overflow="fold")
    for line in table.lines:
        grid.add_row(*(Text(cell) for cell in line), style="yellow" if line[-1].startswith("LEAK") else "")
    console.print(grid)
    for note in table.notes:
        console.print(Padding(Text(note, style="dim"), (0, 0, 0, 1), expand=False))


def _fitting(columns: Sequence[str], block: Block, width: int) -> tuple[list[int], set[str]]:
    """Return the columns to show, and the names of those that there is no room for; empty columns are never shown."""
    widths = {
        place: max(len(columns[place]), *(len(line.cells[place]) for line in block.lines)) + _AROUND_A_CELL
        for place in range(len(columns))
        if any(line.cells[place].strip("–") for line in block.lines)
    }
    gone: set[str] = set()
    for name in _FIRST_TO_GO:
        if sum(widths.values()) + _AROUND_A_CELL <= width:
            break
        place = columns.index(name)
        if widths.pop(place, None) is not None:
            gone.add(name)
    return list(widths), gone
