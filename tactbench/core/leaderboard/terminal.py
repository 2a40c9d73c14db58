"""The table on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tactbench.core.leaderboard.table import NUMERIC, build_table

if TYPE_CHECKING:
    from rich.console import Console

_STYLE = {"result": "bold", "baseline": "dim", "failed": "red"}


def show(rows: Sequence[Mapping[str, Any]], console: Console) -> None:
    """Print the leaderboard of `rows` on `console`; text from plugins is never read as markup."""
    from rich import box
    from rich.padding import Padding
    from rich.table import Table as RichTable
    from rich.text import Text

    table = build_table(rows)
    for block in table.blocks:
        grid = RichTable(title=Text(block.title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        # A column nobody fills only takes room from the others.
        filled = [
            place for place in range(len(table.columns)) if any(line.cells[place].strip("–") for line in block.lines)
        ]
        for place in filled:
            name = table.columns[place]
            grid.add_column(Text(name), justify="right" if name in NUMERIC else "left", overflow="fold")
        for line in block.lines:
            grid.add_row(*(Text(line.cells[place]) for place in filled), style=_STYLE[line.kind])
        console.print(grid)
    for note in table.notes:
        console.print(Padding(Text(note, style="dim"), (0, 0, 0, 1)))
