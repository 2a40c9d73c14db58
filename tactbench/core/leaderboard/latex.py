"""The leaderboard as LaTeX.

What is printed by default fits one column of a two-column paper; all columns make a table over both.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, zip_longest

from tactbench.core.leaderboard import view as viewed
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.columns import INTERVALS
from tactbench.core.leaderboard.notes import RANKS, interval_notes
from tactbench.core.leaderboard.table import Table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, View
from tactbench.core.tables.fitting import fit, wrapped
from tactbench.core.tables.latex import SEP_PT, latex_table, points, tex
from tactbench.core.tables.numbers import whole
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable

COLUMN_PT = 229.0
"""Width of one column of a two-column paper, in points: of the class article 229.5, of others 239 (84 mm) and more."""
_IN_A_COLUMN = ("sensor", "estimator", "score", "beyond floor", "95 % interval", "95 % beyond", "published")
_FIRST_TO_GO = ("published", "score")


def latex(table: Table, view: View = DEFAULT_VIEW) -> str:
    """Return the table as LaTeX, a table a block; notes and footer stand below the last block."""
    parts: list[str] = []
    whole_width = view.wide or bool(view.columns)
    last = len(table.blocks) - 1
    for place, (block, grid) in enumerate(zip(table.blocks, viewed.grids(table, view), strict=True)):
        # A paper's table shows no ranks.
        shown = [note for note in viewed.notes(table, view) if whole_width or note != RANKS]
        notes = [*shown, *viewed.footer(table, view)] if place == last else []
        if not whole_width:
            grid = grid.only([name for name in grid.columns if name in _IN_A_COLUMN])
        grid = replace(grid, title=_caption(block, grid))
        parts += latex_table(grid, notes, number=place) if whole_width else _in_a_column(grid, notes, number=place)
    for number, section in enumerate(viewed.sections(table, view), len(table.blocks)):
        parts += latex_table(section, section.notes, number=number)
    parts += [f"% {tex(text)}" for text in viewed.commands(table, view)]
    return "\n".join(parts) + "\n"


def _caption(block: Block, grid: TextTable) -> str:
    """Return the title of a block, its verdict, how many samples were tested and what its intervals are."""
    rows = [line.row for line in block.lines if line.row["status"] == "done" and not line.row["is_baseline"]]
    counts = sorted({row["n_test"] for row in rows if row["n_test"] is not None})
    n = f"n = {'–'.join(map(whole, dict.fromkeys((counts[0], counts[-1]))))} test samples" if counts else ""
    task = f"{visible(str(block.lines[0].row['task']))}: "
    how = [f"95 % {text.removeprefix(task)}" for text in interval_notes(rows)] if rows else []
    rule = "Below the rule: trivial answers" if "#" not in grid.columns and _first_trivial(grid) else ""
    sentences = [text.rstrip(".") for text in (block.title, *grid.summary[:1], n, *how, rule) if text]
    return f"{'. '.join(sentences)}."


def _in_a_column(grid: TextTable, notes: Sequence[str], *, number: int) -> list[str]:
    """Return a table as LaTeX: of one column, long texts broken into further lines."""
    places = {name: place for place, name in enumerate(grid.columns)}
    gap = 2 * SEP_PT
    intervals = {places[name] for name in INTERVALS if name in places}
    widths, hidden = fit(
        grid.headers, grid.lines, {places["sensor"], places["estimator"], *intervals}, room=COLUMN_PT - gap, gap=gap,
        measure=points, first_to_go=[places[name] for name in _FIRST_TO_GO if name in places], broken_last=intervals,
    )  # fmt: skip
    if hidden:
        notes = [*notes, f"There was no room for: {', '.join(grid.headers[place] for place in hidden)}."]
    lines = [_broken(cells, widths) for cells in grid.lines]
    begins = [0, *accumulate(map(len, lines))]
    kept = replace(
        grid,
        columns=tuple(grid.columns[place] for place in widths),
        headings=(),
        lines=tuple(line for one in lines for line in one),
    )
    rules = [begins[place] for place in _first_trivial(grid)]
    heads = _broken(grid.headers, widths)
    return latex_table(kept, notes, headings=heads, number=number, over_both=False, rules=rules)


def _first_trivial(grid: TextTable) -> list[int]:
    """Return the place of the first trivial answer, if a table of one column, which shows no ranks, has some."""
    return [grid.kinds.index("baseline")] if "baseline" in grid.kinds and grid.kinds[0] != "baseline" else []


def _broken(cells: Sequence[str], widths: Mapping[int, float]) -> list[tuple[str, ...]]:
    parts: Iterable[list[str]] = (wrapped(cells[place], room, points) for place, room in widths.items())
    return list(zip_longest(*parts, fillvalue=""))
